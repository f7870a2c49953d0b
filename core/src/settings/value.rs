//! Fields of a configuration as values that text can set.

/// A borrowed field of a configuration.
pub enum Value<'c> {
    /// A switch.
    Bool(&'c mut bool),
    /// A small count.
    U8(&'c mut u8),
    /// A count.
    U16(&'c mut u16),
    /// A large count.
    U32(&'c mut u32),
    /// A count of what is in memory.
    Usize(&'c mut usize),
    /// A number.
    F32(&'c mut f32),
    /// A precise number.
    F64(&'c mut f64),
    /// A list of small numbers.
    Bytes(&'c mut [u8]),
    /// One of several names.
    Choice(&'c mut dyn Choice),
    /// A number that is read only, for callers with a configuration language; `None` where unset.
    Number(Option<f64>),
}

/// An enumeration whose variants have names.
pub trait Choice {
    /// Names of all variants.
    fn names(&self) -> &'static [&'static str];
    /// Sets the variant of this name; `None` where no variant has it.
    fn choose(&mut self, name: &str) -> Option<()>;
}

/// Lists the variants of enumerations under the names that files and text use for them.
macro_rules! choices {
    ($($choice:ty { $($name:literal = $variant:ident),* $(,)? })*) => {
        $(impl $crate::settings::Choice for $choice {
            fn names(&self) -> &'static [&'static str] {
                &[$($name),*]
            }

            fn choose(&mut self, name: &str) -> Option<()> {
                *self = match name {
                    $($name => Self::$variant,)*
                    _ => return None,
                };
                Some(())
            }
        })*
    };
}
pub(crate) use choices;

impl Value<'_> {
    /// The number, where it is one and set.
    pub fn number(&self) -> Option<f64> {
        Some(match self {
            Self::U8(value) => f64::from(**value),
            Self::U16(value) => f64::from(**value),
            Self::U32(value) => f64::from(**value),
            Self::Usize(value) => **value as f64,
            Self::F32(value) => f64::from(**value),
            Self::F64(value) => **value,
            Self::Number(value) => return *value,
            Self::Bool(_) | Self::Bytes(_) | Self::Choice(_) => return None,
        })
    }

    /// Names that a choice takes; none for numbers.
    pub fn names(&self) -> &'static [&'static str] {
        match self {
            Self::Choice(choice) => choice.names(),
            _ => &[],
        }
    }

    /// Sets the value; `None`, and nothing has changed, where the text is none.
    ///
    /// ```
    /// use dynvox_core::settings::Value;
    ///
    /// let mut count = 3;
    /// assert_eq!(Value::U16(&mut count).set("many"), None);
    /// assert_eq!(Value::U16(&mut count).set("12"), Some(()));
    /// assert_eq!(count, 12);
    /// ```
    pub fn set(&mut self, text: &str) -> Option<()> {
        match self {
            Self::Bool(value) => **value = text.parse().ok()?,
            Self::U8(value) => **value = text.parse().ok()?,
            Self::U16(value) => **value = text.parse().ok()?,
            Self::U32(value) => **value = text.parse().ok()?,
            Self::Usize(value) => **value = text.parse().ok()?,
            Self::F32(value) => **value = text.parse().ok()?,
            Self::F64(value) => **value = text.parse().ok()?,
            Self::Choice(choice) => choice.choose(text)?,
            Self::Bytes(values) => {
                // All numbers are read before the first is set: an error changes nothing.
                let numbers = || text.split(',').map(|number| number.trim().parse::<u8>());
                if numbers().count() != values.len() || numbers().any(|number| number.is_err()) {
                    return None;
                }
                for (value, number) in values.iter_mut().zip(numbers().flatten()) {
                    *value = number;
                }
            }
            Self::Number(_) => return None,
        }
        Some(())
    }
}
