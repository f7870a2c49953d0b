//! Panes, shop fronts, doors and boards.

use super::paint::Painter;
use super::pattern::{Painted, SurfacePoint, above, blend, stripes, survives, times, within};
use super::random::{cell, unit};
use super::surface::{Surface, Tone};
use super::texture::floor;

/// Glass as one sees it by day: dark rooms, a little sky, brighter upwards.
fn glass(painter: &Painter, surface: &Surface, surface_point: &SurfacePoint) -> Tone {
    let height = surface.size_m[1];
    let up = 1.0 - surface_point.surface_m[1] / height;
    let mirrored = painter.broad(surface.seed, surface_point, 3.0);
    let sky =
        (0.02 + 0.12 * up * up) * (1.0 + 0.55 * mirrored).max(0.0) * (0.4 + unit(surface.seed));
    blend(times(surface.tone, 0.7), [0.42, 0.52, 0.66], sky.min(0.6))
}

/// A window: frame, bars, and what hangs behind it.
pub fn window(painter: &Painter, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
    let ([u, v, _], [fu, fv, _], [width, height]) =
        (surface_point.surface_m, surface_point.footprint_m, surface.size_m);
    let h = surface.seed;
    let mut tone = glass(painter, surface, surface_point);
    // Folds of cloth: noise stretched along v.
    let folds = || {
        let hung = SurfacePoint {
            footprint_m: [fu, 0.2 * fv, 0.0],
            surface_m: [u * 1.5, v * 0.2, 0.0],
            own_normal: [0.0; 3],
        };
        1.0 + 0.12 * painter.fine(h, &hung, 1.0)
    };
    let cloth = [[0.62, 0.60, 0.55], [0.55, 0.50, 0.40], [0.60, 0.60, 0.62], [0.40, 0.30, 0.26]]
        [(h >> 3) as usize & 3];
    // Curtains, a blind, net curtains, or nothing, as the seed says.
    match h % 6 {
        0 | 1 => {
            let open = 0.2 + 0.25 * unit(h << 6);
            let hang = 1.0 - within(open * width, (1.0 - open) * width, u, fu);
            tone = blend(tone, times(cloth, 0.5 * folds()), 0.8 * hang);
        }
        2 => {
            let lowered = height * (0.2 + 0.7 * unit(h << 8));
            let slat = 1.0 - 0.25 * stripes(v, 0.06, 0.02, fv);
            tone = blend(tone, times(cloth, 0.55 * slat), 0.9 * (1.0 - above(lowered, v, fv)));
        }
        3 => tone = blend(tone, times(cloth, 0.42 * folds()), 0.55),
        _ => {}
    }
    let border = 0.055;
    let mut bars =
        1.0 - within(border, width - border, u, fu) * within(border, height - border, v, fv);
    // Wide windows have two sashes or three.
    if width > 0.75 {
        let sashes = if width > 1.5 { 3.0 } else { 2.0 };
        let step = width / sashes;
        let near = u / step;
        let off = (near - floor(near + 0.5) as f32) * step;
        bars = bars.max(within(-0.035, 0.035, off, fu));
    }
    if (h >> 5) & 1 == 0 {
        bars = bars.max(within(0.30 * height, 0.30 * height + 0.05, v, fv));
    }
    Painted { tone: blend(tone, surface.second, bars), gloss: 0.30 * (1.0 - bars), open: 1.0 }
}

/// A shop: large panes, goods and lamps behind them.
pub fn shop(painter: &Painter, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
    let ([u, v, _], [fu, fv, _], [width, height]) =
        (surface_point.surface_m, surface_point.footprint_m, surface.size_m);
    let mut tone = glass(painter, surface, surface_point);
    // Goods: boxes on shelves, each of its own tone.
    let shelf = height / 4.0;
    let (row, column) = (floor(v / shelf), floor(u / 0.42));
    let h = cell(surface.seed, column, row);
    let tall = (0.25 + 0.65 * unit(h << 3)) * shelf;
    let goods = within((row + 1) as f32 * shelf - tall, (row + 1) as f32 * shelf - 0.03, v, fv);
    let goods = goods
        * within(
            column as f32 * 0.42 + 0.03,
            column as f32 * 0.42 + 0.2 + 0.2 * unit(h << 9),
            u,
            fu,
        );
    let own = [unit(h), unit(h << 5), unit(h << 11)].map(|value| 0.03 + 0.30 * value * value);
    // Goods smaller than a pixel merge into the shelf's tone.
    let kept = survives(0.42, fu.max(fv));
    if row > 0 {
        tone = blend(tone, own, 0.65 * goods * kept);
    }
    // Lamps on the ceiling.
    let lamp = stripes(u + 0.4, 1.3, 0.5, fu) * within(0.08, 0.14, v, fv);
    tone = blend(tone, [1.1, 1.05, 0.9], lamp * 0.8);
    let mut bars = 1.0 - within(0.07, width - 0.07, u, fu) * within(0.07, height - 0.09, v, fv);
    if width > 1.8 {
        bars = bars.max(within(0.5 * width - 0.035, 0.5 * width + 0.035, u, fu));
    }
    Painted { tone: blend(tone, surface.second, bars), gloss: 0.30 * (1.0 - bars), open: 1.0 }
}

/// A shop's name: letters of strokes that spell nothing.
pub fn board(painter: &Painter, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
    let ([u, v, _], [fu, fv, _], [width, height]) =
        (surface_point.surface_m, surface_point.footprint_m, surface.size_m);
    let ground = times(
        surface.tone,
        1.0 + 0.05 * painter.fine(surface.seed, surface_point, 1.0)
            + 0.05 * painter.broad(surface.seed, surface_point, 1.0),
    );
    // As many letters as the seed says, centred.
    let letter = 0.34;
    let count = 5 + (surface.seed % 6) as i32;
    let start = 0.5 * width - 0.5 * letter * count as f32;
    let column = (u - start) / letter;
    let number = floor(column);
    if number < 0 || number >= count {
        return Painted::dull(ground);
    }
    let h = cell(surface.seed, number, 1);
    let (x, y) = ((column - number as f32) * letter, (v - 0.14) / (height - 0.28));
    let fy = fv / (height - 0.28);
    let upright = |at: f32| within(at, at + 0.055, x, fu) * within(0.0, 1.0, y, fy);
    let bar = |at: f32| within(at - 0.08, at + 0.08, y, fy) * within(0.04, 0.26, x, fu);
    let mut ink: f32 = 0.0;
    // Each letter is a set of six strokes.
    for (bit, stroke) in
        [upright(0.04), upright(0.205), bar(0.08), bar(0.5), bar(0.92), upright(0.12)]
            .into_iter()
            .enumerate()
    {
        if h >> bit & 1 == 1 || bit == (h >> 8) as usize % 2 {
            ink = ink.max(stroke);
        }
    }
    // One letter in sixteen is a space.
    let space = h >> 12 & 15 == 0;
    Painted::dull(blend(ground, surface.second, if space { 0.0 } else { ink }))
}

/// A door with panels and a light above.
pub fn door(painter: &Painter, surface: &Surface, surface_point: &SurfacePoint) -> Painted {
    let ([u, v, _], [fu, fv, _], [width, height]) =
        (surface_point.surface_m, surface_point.footprint_m, surface.size_m);
    let wood = times(surface.tone, 1.0 + 0.08 * painter.fine(surface.seed, surface_point, 1.0));
    let mut tone = wood;
    // Two rows of two panels, each with a groove around it.
    for (from, to) in [(0.30, 0.58), (0.64, 0.95)] {
        for (a, b) in [(0.14, 0.46), (0.54, 0.86)] {
            let panel = |grow: f32| {
                within(a * width - grow, b * width + grow, u, fu)
                    * within(from * height - grow, to * height + grow, v, fv)
            };
            let groove = panel(0.015) - panel(-0.015);
            tone = blend(tone, times(wood, 0.45), groove.max(0.0));
        }
    }
    let light =
        within(0.10 * width, 0.90 * width, u, fu) * within(0.04 * height, 0.22 * height, v, fv);
    tone = blend(tone, [0.05, 0.06, 0.075], light);
    let handle =
        within(0.86 * width, 0.92 * width, u, fu) * within(0.56 * height, 0.62 * height, v, fv);
    tone = blend(tone, [0.6, 0.55, 0.4], handle);
    let frame = 1.0 - within(0.05, width - 0.05, u, fu) * above(0.05, v, fv);
    Painted { tone: blend(tone, surface.second, frame), gloss: 0.04, open: 1.0 }
}

/// A sign's face in coordinates -1..1.
pub fn sign(surface: &Surface, surface_point: &SurfacePoint) -> Painted {
    let [x, y, _] = surface_point.surface_m;
    let [fx, fy, _] = surface_point.footprint_m;
    let f = fx.max(fy);
    let radius = (x * x + y * y).sqrt();
    let (red, white, blue, black) =
        ([0.50, 0.02, 0.02], [0.80, 0.80, 0.78], [0.02, 0.10, 0.42], [0.02, 0.02, 0.02]);
    let tone = match surface.seed {
        0 => {
            let ink = within(-0.32, -0.10, x, fx) * within(-0.3, 0.3, y, fy)
                + within(0.08, 0.36, x, fx) * within(-0.3, 0.3, y, fy);
            let hole = within(0.16, 0.28, x, fx) * within(-0.2, 0.2, y, fy);
            blend(blend(white, black, (ink - hole).clamp(0.0, 1.0)), red, above(0.72, radius, f))
        }
        1 => {
            let cross = within(-0.1, 0.1, x - y, 2.0 * f).max(within(-0.1, 0.1, x + y, 2.0 * f));
            blend(blend(blue, red, cross), red, above(0.78, radius, f))
        }
        2 => {
            // Distance to the triangle's nearest side.
            let side = (0.5 - y).min(0.5 + 0.5 * y - 0.866 * x).min(0.5 + 0.5 * y + 0.866 * x);
            let ink = within(-0.05, 0.05, x, fx) * within(-0.35, 0.2, y, fy);
            blend(blend(white, black, ink), red, 1.0 - above(0.13, side, f))
        }
        3 => {
            let stem = within(-0.28, -0.12, x, fx) * within(-0.45, 0.45, y, fy);
            let bowl = within(-0.12, 0.26, x, fx) * within(-0.45, 0.05, y, fy)
                - within(-0.12, 0.1, x, fx) * within(-0.3, -0.1, y, fy);
            let rim = 1.0 - within(-0.64, 0.64, x, fx) * within(-0.64, 0.64, y, fy);
            blend(blue, white, (stem + bowl + rim).clamp(0.0, 1.0))
        }
        _ => {
            let stripes = within(-0.5, 0.5, x, fx)
                * (within(-0.35, -0.2, y, fy)
                    + within(-0.05, 0.1, y, fy)
                    + within(0.25, 0.4, y, fy));
            blend([0.72, 0.56, 0.05], black, stripes)
        }
    };
    Painted { tone, gloss: 0.05, open: 1.0 }
}
