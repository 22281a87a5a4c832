//! Names of files from templates: `out/{job}-{exponent}-{frame:4}.png`.

use std::collections::BTreeMap;
use std::path::Path;

/// What may stand in braces.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Variables(BTreeMap<String, Option<String>>);

/// Why a template gives no name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// A brace has no partner.
    #[error("`{template}`: a brace is not closed; write {{name}} or {{name:width}}")]
    Brace {
        /// The template.
        template: String,
    },
    /// Nothing has this name.
    #[error("`{template}`: nothing is called {{{name}}}; there are {known}")]
    Unknown {
        /// The template.
        template: String,
        /// What stands in its braces.
        name: String,
        /// What could.
        known: String,
    },
    /// Several things have this name.
    #[error("`{template}`: {{{name}}} may mean several things; write the whole path")]
    Ambiguous {
        /// The template.
        template: String,
        /// What stands in its braces.
        name: String,
    },
}

impl Variables {
    /// Gives a name its value, in place of an earlier one.
    pub fn set(&mut self, name: impl Into<String>, value: impl ToString) {
        self.0.insert(name.into(), Some(value.to_string()));
    }

    /// Gives the path of an override its value; its last key will do as its name unless another has the same.
    pub fn set_path(&mut self, path: &str, value: &str) {
        let value = value.trim_matches('"').to_owned();
        let last = path.rsplit('.').next().unwrap_or(path);
        let changed = self.0.contains_key(path);
        if last != path {
            let short = self.0.get(last).cloned();
            let meant = if short.is_some() && !changed { None } else { Some(value.clone()) };
            self.0.insert(last.to_owned(), meant);
        }
        self.0.insert(path.to_owned(), Some(value));
    }

    /// Gives `spp` and `seed` the values that a scene file says, unless an override has given them others.
    pub fn set_from_scene(&mut self, scene: &Path) {
        // A file that cannot be read says so when its picture is made.
        let text = std::fs::read_to_string(scene).unwrap_or_default();
        let document: Option<serde_json::Value> =
            toml::from_str(&text).ok().or_else(|| serde_json::from_str(&text).ok());
        for name in ["spp", "seed"] {
            let value = document.as_ref().and_then(|d| d.get("settings")?.get(name)?.as_u64());
            if let (Some(value), false) = (value, self.0.contains_key(name)) {
                self.set(name, value);
            }
        }
    }

    /// The template with the values in the place of the braces; what a file's name cannot hold becomes `_`.
    ///
    /// # Errors
    /// If a name in braces is unknown or means several things.
    pub fn fill(&self, template: &str) -> Result<String, NameError> {
        let brace = || NameError::Brace { template: template.to_owned() };
        let (mut filled, mut rest) = (String::new(), template);
        while let Some((before, after)) = rest.split_once('{') {
            let (inside, behind) = after.split_once('}').ok_or_else(brace)?;
            let (name, width) = match inside.split_once(':') {
                Some((name, width)) => (name, width.parse::<usize>().map_err(|_| brace())?),
                None => (inside, 0),
            };
            filled.push_str(before);
            let value = self.value(template, name)?;
            filled.extend(std::iter::repeat_n('0', width.min(64).saturating_sub(value.chars().count())));
            filled.extend(value.chars().map(|c| if "/\\: \t\n".contains(c) { '_' } else { c }));
            rest = behind;
        }
        filled.push_str(rest);
        Ok(filled)
    }

    fn value(&self, template: &str, name: &str) -> Result<&str, NameError> {
        let (template, name) = (template.to_owned(), name.to_owned());
        match self.0.get(&name) {
            Some(Some(value)) => Ok(value),
            Some(None) => Err(NameError::Ambiguous { template, name }),
            None => {
                let known: Vec<_> = self.0.keys().map(|key| format!("{{{key}}}")).collect();
                Err(NameError::Unknown { template, name, known: known.join(", ") })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braces_become_values_that_a_file_name_can_hold() {
        let mut variables = Variables::default();
        variables.set("frame", 7);
        variables.set_path("materials.lemon.exponent", "1e5");
        variables.set_path("settings.horizon", "\"fold/x\"");
        assert_eq!(variables.fill("a/{exponent}-{frame:4}.png").unwrap(), "a/1e5-0007.png");
        assert_eq!(variables.fill("{materials.lemon.exponent}{horizon}").unwrap(), "1e5fold_x");
        assert_eq!(variables.fill("plain").unwrap(), "plain");
    }

    #[test]
    fn names_that_mean_nothing_or_too_much_are_refused() {
        let mut variables = Variables::default();
        variables.set_path("materials.a.exponent", "1");
        variables.set_path("materials.b.exponent", "2");
        assert!(matches!(variables.fill("{exponent}"), Err(NameError::Ambiguous { .. })));
        assert_eq!(variables.fill("{materials.b.exponent}").unwrap(), "2");
        let message = variables.fill("{spp}").unwrap_err().to_string();
        assert!(message.contains("{materials.a.exponent}"), "{message}");
        assert!(matches!(variables.fill("{spp"), Err(NameError::Brace { .. })));
        assert!(matches!(variables.fill("{spp:x}"), Err(NameError::Brace { .. })));
    }

    #[test]
    fn a_scene_says_its_samples_and_seed() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.toml");
        std::fs::write(&path, "[settings]\nspp = 16\nseed = 3\n").unwrap();
        let mut variables = Variables::default();
        variables.set_path("settings.seed", "5");
        variables.set_from_scene(&path);
        assert_eq!(variables.fill("{spp}-{seed}").unwrap(), "16-5");
    }

    #[test]
    fn a_later_value_of_the_same_path_counts() {
        let mut variables = Variables::default();
        variables.set_path("settings.spp", "1");
        variables.set_path("settings.spp", "2");
        assert_eq!(variables.fill("{spp}").unwrap(), "2");
    }
}
