//! Classes that detectors name, independent of the data set, and how each class is treated.

/// The class of an object. One neutral list; names of PASCAL VOC, COCO, Cityscapes and KITTI map to
/// it by [`Class::from_name`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Class {
    /// Nothing that moves by itself, or nothing known.
    #[default]
    Other,
    /// Passenger car.
    Car,
    /// Bus or coach.
    Bus,
    /// Lorry, trailer or caravan.
    Truck,
    /// Van.
    Van,
    /// Train or tram.
    Train,
    /// Somebody on foot or sitting.
    Person,
    /// Somebody on a bicycle or motorcycle.
    Rider,
    /// Bicycle.
    Bicycle,
    /// Motorcycle or moped.
    Motorcycle,
    /// Any animal.
    Animal,
    /// Moving object, found by its motion.
    MovingObject,
}

/// Treatment of a class by the mapper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// Rigid and possibly moving: tracked and reconstructed in a volume of its own.
    Reconstruct,
    /// Possibly moving, but not rigid or not to be modelled: kept out of the static map, tracked,
    /// not reconstructed.
    KeepOut,
    /// Part of the static world.
    Ignore,
}

/// All names known, lower case. VOC, COCO, Cityscapes, KITTI labels, MOTS.
const NAMES: [(&str, Class); 44] = [
    ("car", Class::Car),
    ("bus", Class::Bus),
    ("truck", Class::Truck),
    ("lorry", Class::Truck),
    ("trailer", Class::Truck),
    ("caravan", Class::Truck),
    ("van", Class::Van),
    ("train", Class::Train),
    ("tram", Class::Train),
    ("on rails", Class::Train),
    ("person", Class::Person),
    ("pedestrian", Class::Person),
    ("person_sitting", Class::Person),
    ("rider", Class::Rider),
    ("cyclist", Class::Rider),
    ("bicycle", Class::Bicycle),
    ("motorcycle", Class::Motorcycle),
    ("motorbike", Class::Motorcycle),
    ("bird", Class::Animal),
    ("cat", Class::Animal),
    ("dog", Class::Animal),
    ("horse", Class::Animal),
    ("sheep", Class::Animal),
    ("cow", Class::Animal),
    ("elephant", Class::Animal),
    ("bear", Class::Animal),
    ("zebra", Class::Animal),
    ("giraffe", Class::Animal),
    ("animal", Class::Animal),
    ("moving object", Class::MovingObject),
    ("aeroplane", Class::Other),
    ("airplane", Class::Other),
    ("boat", Class::Other),
    ("bench", Class::Other),
    ("building", Class::Other),
    ("traffic light", Class::Other),
    ("fire hydrant", Class::Other),
    ("stop sign", Class::Other),
    ("parking meter", Class::Other),
    ("potted plant", Class::Other),
    ("pottedplant", Class::Other),
    ("misc", Class::Other),
    ("dontcare", Class::Other),
    ("background", Class::Other),
];

impl Class {
    /// All classes, in the order of their codes.
    pub const ALL: [Self; 12] = [
        Self::Other,
        Self::Car,
        Self::Bus,
        Self::Truck,
        Self::Van,
        Self::Train,
        Self::Person,
        Self::Rider,
        Self::Bicycle,
        Self::Motorcycle,
        Self::Animal,
        Self::MovingObject,
    ];

    /// The class a data set means by a name, in upper or lower case; `None` for an unknown name.
    ///
    /// ```
    /// use dynvox_core::tracking::Class;
    ///
    /// assert_eq!(Class::from_name("Pedestrian"), Some(Class::Person));
    /// assert_eq!(Class::from_name("unicorn"), None);
    /// ```
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.trim();
        NAMES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|&(_, class)| class)
    }

    /// The class of a code, as tables keep it; [`Class::Other`] for an unknown code.
    pub fn from_code(code: u32) -> Self {
        Self::ALL.get(code as usize).copied().unwrap_or_default()
    }

    /// The code: its index in [`Class::ALL`].
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Other => "other",
            Self::Car => "car",
            Self::Bus => "bus",
            Self::Truck => "truck",
            Self::Van => "van",
            Self::Train => "train",
            Self::Person => "person",
            Self::Rider => "rider",
            Self::Bicycle => "bicycle",
            Self::Motorcycle => "motorcycle",
            Self::Animal => "animal",
            Self::MovingObject => "moving object",
        }
    }

    /// Returns the treatment of the class.
    pub const fn treatment(self) -> Treatment {
        match self {
            Self::Car | Self::Bus | Self::Truck | Self::Van | Self::MovingObject => {
                Treatment::Reconstruct
            }
            Self::Train
            | Self::Person
            | Self::Rider
            | Self::Bicycle
            | Self::Motorcycle
            | Self::Animal => Treatment::KeepOut,
            Self::Other => Treatment::Ignore,
        }
    }

    /// Returns true if a detector may give one object both classes from frame to frame:
    /// four-wheelers flicker among each other, and so do people and what they ride.
    pub fn agrees_with(self, other: Self) -> bool {
        let group = |class: Self| match class {
            Self::Car | Self::Bus | Self::Truck | Self::Van => 1,
            Self::Person | Self::Rider => 2,
            Self::Bicycle | Self::Motorcycle => 3,
            _ => 0,
        };
        let is_found_by_motion = self == Self::MovingObject || other == Self::MovingObject;
        let may_move =
            self.treatment() != Treatment::Ignore && other.treatment() != Treatment::Ignore;
        self == other
            || (is_found_by_motion && may_move)
            || (group(self) == group(other) && group(self) != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_every_data_set_map_to_their_class() {
        for (name, class) in [
            ("car", Class::Car),
            ("Van", Class::Van),
            ("Pedestrian", Class::Person),
            ("Cyclist", Class::Rider),
            ("motorbike", Class::Motorcycle),
            ("motorcycle", Class::Motorcycle),
            ("zebra", Class::Animal),
            ("DontCare", Class::Other),
        ] {
            assert_eq!(Class::from_name(name), Some(class), "{name}");
        }
        assert_eq!(Class::from_name("flying saucer"), None);
        assert!(Class::ALL.iter().all(|&class| Class::from_code(class.code()) == class));
        assert_eq!(Class::from_code(1000), Class::Other);
    }

    #[test]
    fn four_wheelers_are_reconstructed_and_other_movers_kept_out() {
        for class in Class::ALL {
            let expected = match class {
                Class::Car | Class::Bus | Class::Truck | Class::Van | Class::MovingObject => {
                    Treatment::Reconstruct
                }
                Class::Other => Treatment::Ignore,
                _ => Treatment::KeepOut,
            };
            assert_eq!(class.treatment(), expected, "{class:?}");
        }
    }

    #[test]
    fn names_flicker_only_within_four_wheelers_people_or_two_wheelers() {
        let kinds: [&[Class]; 5] = [
            &[Class::Car, Class::Bus, Class::Truck, Class::Van],
            &[Class::Person, Class::Rider],
            &[Class::Bicycle, Class::Motorcycle],
            &[Class::Train],
            &[Class::Animal],
        ];
        for (one, other) in
            Class::ALL.iter().flat_map(|one| Class::ALL.iter().map(move |other| (*one, *other)))
        {
            let by_motion = [one, other].contains(&Class::MovingObject)
                && ![one, other].contains(&Class::Other);
            let alike = one == other
                || by_motion
                || kinds.iter().any(|kind| kind.contains(&one) && kind.contains(&other));
            assert_eq!(one.agrees_with(other), alike, "{one:?} and {other:?}");
        }
    }
}
