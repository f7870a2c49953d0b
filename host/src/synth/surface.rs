//! Surfaces of the street's meshes: a kind and the few figures that tell one wall from the next.

/// Linear reflectance of red, green, blue.
pub type Tone = [f32; 3];

/// Linear reflectance from what a screen would show.
pub fn tone(red: u8, green: u8, blue: u8) -> Tone {
    [red, green, blue].map(|value| {
        let share = f32::from(value) / 255.0;
        share * share
    })
}

/// A tone, lighter or darker.
pub fn scaled(tone: Tone, factor: f64) -> Tone {
    tone.map(|value| value * factor as f32)
}

/// Kind of paint on a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Asphalt with markings; coordinates are arc length within the segment and lateral position.
    Road,
    /// Slabs; the same coordinates.
    Pavement,
    /// Granite; along and across.
    Kerb,
    /// Lawn or gravel; the same coordinates as the road.
    Yard,
    /// Painted render.
    Plaster,
    /// Bricks in running bond.
    Brick,
    /// Large hewn blocks.
    Stone,
    /// A window pane with its frame; `size_m` is the opening.
    Window,
    /// A shop's glass front; `size_m` is the opening.
    Shop,
    /// A shop's name board.
    Board,
    /// A panelled door; `size_m` is the opening.
    Door,
    /// Roof tiles.
    Tiles,
    /// Plain matter: metal, painted wood, concrete.
    Plain,
    /// Upright boards.
    Fence,
    /// Tree bark.
    Bark,
    /// Leaves of a tree or hedge.
    Leaves,
    /// A traffic sign's face; `seed` chooses which.
    Sign,
    /// A car's shell, painted by position in the car's frame.
    Car,
    /// A wheel's side: first coordinate is the distance from the hub as a share of the radius.
    Wheel,
    /// Paint of rooms, their furniture and people.
    Indoor(Indoor),
}

/// Paint of what is found in rooms; people's clothes among it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Indoor {
    /// A painted wall; the first of `size_m` is its contrast, 1 of rough plaster, 0 of none.
    Wall,
    /// Printed paper.
    Wallpaper,
    /// Boards of a floor, along the first coordinate.
    Boards,
    /// A woven rug.
    Rug,
    /// Wood with its grain along the first coordinate.
    Wood,
    /// Backs of folders, side by side along the first coordinate.
    Folders,
    /// A framed picture; `size_m` is its size.
    Picture,
    /// Cloth with a pattern.
    Cloth,
}

/// A material.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Kind of paint.
    pub kind: Kind,
    /// Main tone.
    pub tone: Tone,
    /// Second tone: joints, frames, letters.
    pub second: Tone,
    /// Shifts textures and chooses variants.
    pub seed: u32,
    /// Size of what is painted once, m.
    pub size_m: [f32; 2],
    /// Seen from both sides.
    pub two_sided: bool,
}

impl Surface {
    /// A surface of one tone.
    pub fn new(kind: Kind, tone: Tone, seed: u32) -> Self {
        Self { kind, tone, second: tone, seed, size_m: [1.0, 1.0], two_sided: false }
    }

    /// With a second tone.
    pub fn with(self, second: Tone) -> Self {
        Self { second, ..self }
    }

    /// With a size.
    pub fn sized(self, width_m: f64, height_m: f64) -> Self {
        Self { size_m: [width_m as f32, height_m as f32], ..self }
    }
}
