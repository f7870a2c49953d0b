//! Faults as the command line names them: `freeze:right@20..,noise=12@5..9,drop%10,seed=3`.

use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// One of a camera's images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left one, in grey and in colour.
    Left,
    /// The right one.
    Right,
    /// Both.
    Both,
}

impl Side {
    pub(super) fn has_left(self) -> bool {
        self != Self::Right
    }

    pub(super) fn has_right(self) -> bool {
        self != Self::Left
    }
}

/// Kind of a planted fault.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// It is lost; the time stamps show it.
    Drop,
    /// The frame before is delivered in its place.
    Duplicate,
    /// It is delivered after the one behind it.
    Swap,
    /// The recording goes on so many frames later, and its time stamps do not show it.
    Jump(usize),
    /// Left and right are exchanged.
    Exchange,
    /// The image of the first frame of the fault is delivered again and again.
    Freeze(Side),
    /// The image of the frame before is delivered.
    Delay(Side),
    /// Nothing but black.
    Black(Side),
    /// Gaussian noise of this standard deviation, grey levels.
    Noise(Side, f64),
    /// Something grey before the lens covers this share of the columns, from the left.
    Occlude(Side, f64),
    /// All values times this factor: another exposure.
    Brightness(Side, f64),
    /// The rear of a truck this far ahead, which drives at the camera's speed, m.
    Truck(f64),
    /// A person this far ahead, who walks at the camera's speed, m.
    Walker(f64),
    /// A row of buses that fills the view 5 m ahead and passes by so many m a frame.
    Bus(f64),
    /// The vehicle's own bonnet over this lower share of both images.
    Bonnet(f64),
    /// A windscreen's reflection of this weight over the lower half of both images.
    Reflection(f64),
    /// Dirt on about this share of both lenses.
    Dirt(f64),
    /// Only this middle share of the images' sides shows anything: what is far.
    Tunnel(f64),
    /// A pattern that each sensor has in all frames alike, grey levels (1 sigma).
    Pattern(f64),
    /// So many streaks of rain in each image.
    Rain(usize),
    /// Leaves in the upper half move to and fro by so many px.
    Wind(f64),
    /// The right image moves by so many px a frame: a rig that warms up.
    Drift(f64),
    /// Images are larger than calibrated by this factor.
    Zoom(f64),
    /// JPEG compression of this quality, percent.
    Jpeg(u8),
    /// Each frame's brightness is another one, by up to this share.
    Flicker(f64),
    /// Masks that make no sense: the whole image, one pixel, a score of 1.
    Masks,
}

/// A fault and the frames it happens in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Position of the first frame.
    pub first: usize,
    /// Position after the last frame.
    pub end: usize,
    /// Chance of each of these frames, percent.
    pub percent: u32,
}

impl Fault {
    /// Returns true if a frame is among those the fault may affect.
    pub(super) fn covers(&self, position: usize) -> bool {
        (self.first..self.end).contains(&position)
    }
}

/// Faults to be injected, in order, and the seed of what is drawn for them.
///
/// ```
/// use dynvox::input::faults::{FaultKind, Faults, Side};
///
/// let faults: Faults = "freeze:right@20..,noise=12@5,drop%10,seed=3".parse()?;
/// assert_eq!((faults.list[0].kind, faults.list[0].first), (FaultKind::Freeze(Side::Right), 20));
/// assert_eq!((faults.list[1].end, faults.list[2].percent, faults.seed), (6, 10, 3));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Faults {
    /// One after the other.
    pub list: Vec<Fault>,
    /// Seed.
    pub seed: u64,
}

/// Grammar of a specification, for messages.
const GRAMMAR: &str = "NAME[:left|:right][=AMOUNT][@FIRST[..[END]]][%PERCENT], separated by \
    commas, with NAME one of drop, duplicate, swap, \
                       jump=FRAMES, exchange, freeze, delay, black, noise=GREY_LEVELS, \
                       occlude=SHARE, brightness=FACTOR, masks, truck=METRES, \
                       walker=METRES, bus=METRES_A_FRAME, bonnet=SHARE, reflection=SHARE, \
                       dirt=SHARE, tunnel=SHARE, pattern=GREY_LEVELS, rain=STREAKS, wind=PX, \
                       drift=PX_A_FRAME, zoom=FACTOR, jpeg=QUALITY, flicker=SHARE; and seed=N";

impl FromStr for Faults {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut faults = Self { list: Vec::new(), seed: 1 };
        for item in text.split(',').map(str::trim) {
            match item.strip_prefix("seed=") {
                Some(seed) => faults.seed = number(item, seed)?,
                None => faults.list.push(item.parse()?),
            }
        }
        Ok(faults)
    }
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (rest, percent) = match text.split_once('%') {
            Some((rest, percent)) => (rest, number::<u32>(text, percent)?),
            None => (text, 100),
        };
        if !(1..=100).contains(&percent) {
            return Err(format!("{text}: the chance must be 1 to 100 percent"));
        }
        let (what, frames) =
            rest.split_once('@').map_or((rest, None), |(what, frames)| (what, Some(frames)));
        let (first, end) = frames.map_or(Ok((0, usize::MAX)), |frames| range(text, frames))?;
        Ok(Self { kind: kind(text, what)?, first, end, percent })
    }
}

fn number<T: FromStr>(whole: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|_| {
        format!("{whole}: {text} is not a number it can be. Faults are written {GRAMMAR}")
    })
}

/// The frames `FIRST`, `FIRST..` or `FIRST..END`.
fn range(whole: &str, text: &str) -> Result<(usize, usize), String> {
    let (first, end) = match text.split_once("..") {
        None => number(whole, text).map(|first: usize| (first, first.saturating_add(1)))?,
        Some((first, "")) => (number(whole, first)?, usize::MAX),
        Some((first, end)) => (number(whole, first)?, number(whole, end)?),
    };
    if first < end {
        Ok((first, end))
    } else {
        Err(format!("{whole}: there is no frame from {first} to before {end}"))
    }
}

fn kind(whole: &str, text: &str) -> Result<FaultKind, String> {
    let (name, amount) =
        text.split_once('=').map_or((text, None), |(name, amount)| (name, Some(amount)));
    let (name, side) = match name.split_once(':') {
        None => (name, Side::Both),
        Some((name, "left")) => (name, Side::Left),
        Some((name, "right")) => (name, Side::Right),
        Some((_, side)) => {
            return Err(format!("{whole}: there is no camera {side}: left or right"));
        }
    };
    let one_sided =
        matches!(name, "freeze" | "delay" | "black" | "noise" | "occlude" | "brightness");
    if side != Side::Both && !one_sided {
        return Err(format!("{whole}: {name} happens to both cameras"));
    }
    let amount = |least: f64, most: f64| {
        let value: f64 = number(whole, amount.unwrap_or_default())?;
        if (least..=most).contains(&value) {
            Ok(value)
        } else {
            Err(format!("{whole}: the amount must be within {least} to {most}"))
        }
    };
    Ok(match name {
        "drop" => FaultKind::Drop,
        "duplicate" => FaultKind::Duplicate,
        "swap" => FaultKind::Swap,
        "jump" => FaultKind::Jump(amount(1.0, 1e6)? as usize),
        "exchange" => FaultKind::Exchange,
        "freeze" => FaultKind::Freeze(side),
        "delay" => FaultKind::Delay(side),
        "black" => FaultKind::Black(side),
        "noise" => FaultKind::Noise(side, amount(0.0, 255.0)?),
        "occlude" => FaultKind::Occlude(side, amount(0.0, 1.0)?),
        "brightness" => FaultKind::Brightness(side, amount(0.0, 100.0)?),
        "masks" => FaultKind::Masks,
        "truck" => FaultKind::Truck(amount(1.0, 100.0)?),
        "walker" => FaultKind::Walker(amount(0.5, 100.0)?),
        "bus" => FaultKind::Bus(amount(-5.0, 5.0)?),
        "bonnet" => FaultKind::Bonnet(amount(0.0, 1.0)?),
        "reflection" => FaultKind::Reflection(amount(0.0, 1.0)?),
        "dirt" => FaultKind::Dirt(amount(0.0, 1.0)?),
        "tunnel" => FaultKind::Tunnel(amount(0.0, 1.0)?),
        "pattern" => FaultKind::Pattern(amount(0.0, 255.0)?),
        "rain" => FaultKind::Rain(amount(0.0, 1e5)? as usize),
        "wind" => FaultKind::Wind(amount(0.0, 100.0)?),
        "drift" => FaultKind::Drift(amount(-10.0, 10.0)?),
        "zoom" => FaultKind::Zoom(amount(0.25, 4.0)?),
        "jpeg" => FaultKind::Jpeg(amount(1.0, 100.0)? as u8),
        "flicker" => FaultKind::Flicker(amount(0.0, 1.0)?),
        _ => {
            return Err(format!("{whole}: there is no fault {name}. Faults are written {GRAMMAR}"));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_refused_with_the_grammar() {
        for (text, part) in [
            ("melt@3", "NAME[:left"),
            ("noise@3", "not a number"),
            ("noise=300", "within 0 to 255"),
            ("drop:left", "both cameras"),
            ("black:top", "left or right"),
            ("swap@9..9", "no frame"),
            ("drop%0", "1 to 100"),
            ("seed=x", "not a number"),
        ] {
            let error = text.parse::<Faults>().unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
