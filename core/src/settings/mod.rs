//! Settings as rows of tables: one row holds everything there is to say about a setting.
//!
//! Each configuration struct has its table of [`Setting`]s beside it. The rows serve validation,
//! [`Config::set`](crate::Config::set), the command `dynvox settings` and the page
//! `docs/settings.md`. A default stands in the struct's `Default` alone.
//!
//! Memory: firmware links the [`Rule`]s of the rows, 20 bytes and the key each; texts, units and
//! published values are linked only where [`Setting::about`] is used.
//! Time: validation visits each row once; setting searches the rows of one table.

mod constants;
mod problem;
mod range;
mod value;

pub use constants::{CONSTANTS, constant};
pub use problem::{BrokenRule, MAX_PROBLEMS, Problem, Problems, require};
pub use range::Range;
pub(crate) use value::choices;
pub use value::{Choice, Value};

use problem::note;

/// One setting: the rule that machines check, and the text that people read.
///
/// ```
/// use dynvox_core::settings::{Range, Setting, Value::F32};
///
/// struct Robot {
///     speed_m_s: f32,
/// }
/// type Row = Setting<Robot>;
/// const SETTINGS: &[Row] = &[Row::user("robot.speed_m_s", "m/s", |robot| F32(&mut robot.speed_m_s))
///     .range(Range::AboveTo(0.0, 3.0))
///     .text("Fastest speed of the robot.")];
/// assert_eq!(SETTINGS[0].rule.key, "robot.speed_m_s");
/// ```
pub struct Setting<C: 'static> {
    /// The part that validation needs.
    pub rule: Rule<C>,
    /// The unit; empty for numbers without one.
    pub unit: &'static str,
    /// The meaning, in sentences.
    pub text: &'static str,
    /// The value of the original or of the stage's paper where it differs; empty otherwise.
    pub published: &'static str,
    /// The readers it is for.
    pub tier: Tier,
}

/// The part of a row that validation needs, and all of it that firmware holds.
pub struct Rule<C: 'static> {
    /// The key as it stands in a configuration file: `volume.voxel_size_m`.
    pub key: &'static str,
    /// Borrows the field.
    pub value: for<'c> fn(&'c mut C) -> Value<'c>,
    /// Numbers that it may have.
    pub range: Range,
    /// A rule over several fields.
    pub relation: Option<&'static Relation<C>>,
}

/// A rule over several fields of a configuration.
pub struct Relation<C> {
    /// Tells whether a configuration keeps it.
    pub holds: fn(&C) -> bool,
    /// The rule as a text: "must be above volume.near_m".
    pub rule: &'static str,
}

/// Readers a setting is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// Users with another camera, scene, machine or robot.
    User,
    /// Experts who study or improve the stage.
    Expert,
}

/// All that a page says about a setting.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// The key.
    pub key: &'static str,
    /// The unit; empty for numbers without one.
    pub unit: &'static str,
    /// Numbers that it may have; [`Range::Any`] where it is no number.
    pub range: Range,
    /// The rule over several fields, if any.
    pub relation: Option<&'static str>,
    /// Names that it may have; empty where it is a number.
    pub names: &'static [&'static str],
    /// The meaning.
    pub text: &'static str,
    /// The value of the original or of the stage's paper where it differs; empty otherwise.
    pub published: &'static str,
    /// The readers it is for.
    pub tier: Tier,
}

impl<C> Setting<C> {
    /// A row for users with another camera, scene, machine or robot.
    pub const fn user(
        key: &'static str,
        unit: &'static str,
        value: for<'c> fn(&'c mut C) -> Value<'c>,
    ) -> Self {
        Self {
            rule: Rule { key, value, range: Range::Any, relation: None },
            // Texts are added by the methods below.
            unit,
            text: "",
            published: "",
            tier: Tier::User,
        }
    }

    /// A row for experts who study or improve the stage.
    pub const fn expert(
        key: &'static str,
        unit: &'static str,
        value: for<'c> fn(&'c mut C) -> Value<'c>,
    ) -> Self {
        Self { tier: Tier::Expert, ..Self::user(key, unit, value) }
    }

    /// The row with a range.
    pub const fn range(self, range: Range) -> Self {
        Self { rule: Rule { range, ..self.rule }, ..self }
    }

    /// The row with a rule over several fields.
    pub const fn relation(self, relation: &'static Relation<C>) -> Self {
        Self { rule: Rule { relation: Some(relation), ..self.rule }, ..self }
    }

    /// The row with its meaning.
    pub const fn text(self, text: &'static str) -> Self {
        Self { text, ..self }
    }

    /// The row with the value of the original or of the stage's paper.
    pub const fn published(self, published: &'static str) -> Self {
        Self { published, ..self }
    }
}

impl<C: Default> Setting<C> {
    /// All that a page says about the setting.
    pub fn about(&self) -> About {
        let Self { rule, unit, text, published, tier } = *self;
        About {
            key: rule.key,
            unit,
            range: rule.range,
            relation: rule.relation.map(|relation| relation.rule),
            names: (rule.value)(&mut C::default()).names(),
            text,
            published,
            tier,
        }
    }
}

impl<C> Clone for Rule<C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C> Copy for Rule<C> {}

/// The rules of a table without their texts.
///
/// # Panics
/// A table of fewer than `N` rows fails to compile, where it is called.
#[expect(clippy::indexing_slicing, reason = "the compiler evaluates it")]
pub const fn rules<C, const N: usize>(settings: &[Setting<C>]) -> [Rule<C>; N] {
    let mut rules = [settings[0].rule; N];
    let mut at = 0;
    while at < N {
        rules[at] = settings[at].rule;
        at += 1;
    }
    rules
}

/// Notes the rules that a configuration breaks, in the order of the rows.
pub fn check<C: Clone>(rules: &[Rule<C>], config: &C, problems: &mut Problems) {
    // A row borrows its value mutably, also to read it.
    let mut copy = config.clone();
    for Rule { key, value, range, relation } in rules {
        let number = value(&mut copy).number();
        // A setting that is no number has no range.
        if !number.is_none_or(|number| range.contains(number)) {
            note(problems, Problem { key, rule: BrokenRule::Range(*range) });
        } else if let Some(relation) = relation.filter(|relation| !(relation.holds)(config)) {
            note(problems, Problem::new(key, relation.rule));
        }
    }
}

/// Borrows the field of a key.
pub fn find<'c, C>(rules: &[Rule<C>], config: &'c mut C, key: &str) -> Option<Value<'c>> {
    rules.iter().find(|rule| rule.key == key).map(|rule| (rule.value)(config))
}
