//! `[change]`: values of the files that a scenario names.
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::diagnostic::Changes;

/// `[change]`: values of the robot's and of the scene's own file that are changed for this scenario, by the keys that they have there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ChangeSettings {
    /// Of the robot's file.
    #[serde(skip_serializing_if = "Changes::is_empty")]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub robot: Changes,
    /// Of the scene's file.
    #[serde(skip_serializing_if = "Changes::is_empty")]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub scene: Changes,
}

impl ChangeSettings {
    /// Whether nothing is changed.
    pub fn is_empty(&self) -> bool {
        self.robot.is_empty() && self.scene.is_empty()
    }
}
