//! Values of `--state NAME=VALUE`: one value for all rays, a list, or a range.

use rtsl::{LaneBlock, StateVariable};
use serde_json::Value as JsonValue;

use super::random::Random;
use crate::eval::{Lanes, parse_state};
use crate::names::find_state;

/// A state variable and the values that rays get.
#[derive(Clone, Debug)]
pub struct Setting {
    variable: &'static StateVariable,
    values: SettingValues,
}

/// Values with the variable's number of components.
#[derive(Clone, Debug)]
enum SettingValues {
    /// One after the other, repeated.
    Cycle(Vec<Vec<f32>>),
    /// Random, each component between the two.
    Range(Vec<f32>, Vec<f32>),
}

impl Setting {
    /// Parses the value given for the variable `name`.
    pub fn parse(name: &str, json: &JsonValue) -> Result<Setting, String> {
        let variable = find_state(name)?;
        let value = |json: &JsonValue| parse_state(variable, json);
        let values = match (range(json), Lanes::parse(json)) {
            (Some((from, to)), _) => SettingValues::Range(value(from)?, value(to)?),
            (None, Lanes::Uniform(json)) => SettingValues::Cycle(vec![value(&json)?]),
            (None, Lanes::Varying(lanes)) if lanes.is_empty() => {
                return Err(format!("`{name}`: the list of lanes is empty"));
            }
            (None, Lanes::Varying(lanes)) => {
                SettingValues::Cycle(lanes.iter().map(value).collect::<Result<_, _>>()?)
            }
        };
        Ok(Setting { variable, values })
    }

    /// Sets the variable of a ray.
    pub fn apply(&self, random: &mut Random, state: &mut LaneBlock, lane: usize) {
        let mut set = |component: usize, value: f32| {
            state.floats_mut(self.variable.first_component as usize + component)[lane] = value;
        };
        match &self.values {
            SettingValues::Cycle(values) => {
                let components = values[lane % values.len()].iter().enumerate();
                components.for_each(|(component, value)| set(component, *value));
            }
            SettingValues::Range(from, to) => {
                for (component, (from, to)) in from.iter().zip(to).enumerate() {
                    set(component, random.between(*from, *to));
                }
            }
        }
    }
}

/// The ends of `{"from": ..., "to": ...}`.
fn range(json: &JsonValue) -> Option<(&JsonValue, &JsonValue)> {
    let fields = json.as_object().filter(|fields| fields.len() == 2)?;
    Some((fields.get("from")?, fields.get("to")?))
}
