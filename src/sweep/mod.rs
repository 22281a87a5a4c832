//! One scene with some of its values varied: a picture for each combination.

use crate::batch::{NameError, Picture, Variables, check_names_differ};
use crate::scene::Override;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A path in the scene and the values that it takes: `materials.lemon.exponent=1,10,100`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vary {
    /// The path.
    pub path: String,
    /// Its values, as a scene file writes them.
    pub values: Vec<String>,
}

impl FromStr for Vary {
    type Err = String;

    /// Commas within brackets, braces and quotes do not part values.
    fn from_str(text: &str) -> Result<Self, String> {
        const FORM: &str = "write it as path=a,b,c, such as materials.lemon.exponent=1,10,100";
        let (path, list) = text.split_once('=').ok_or(FORM)?;
        let (mut values, mut value) = (vec![], String::new());
        let (mut depth, mut quoted) = (0usize, false);
        for c in list.chars() {
            match c {
                '"' => quoted = !quoted,
                '[' | '{' if !quoted => depth += 1,
                ']' | '}' if !quoted => depth = depth.saturating_sub(1),
                _ => {}
            }
            if c == ',' && depth == 0 && !quoted {
                values.push(std::mem::take(&mut value));
            } else {
                value.push(c);
            }
        }
        values.push(value);
        let values: Vec<String> = values.into_iter().map(|value| value.trim().to_owned()).collect();
        if path.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(FORM.to_owned());
        }
        Ok(Self { path: path.trim().to_owned(), values })
    }
}

/// Why there are no pictures.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SweepError {
    /// Lists of different lengths cannot go side by side.
    #[error(
        "--zip takes one value of each list at a time, but {first} has {first_count} values and {other} has {other_count}"
    )]
    Lengths {
        /// The first list's path.
        first: String,
        /// Its length.
        first_count: usize,
        /// Another's path.
        other: String,
        /// Its length.
        other_count: usize,
    },
    /// One path is varied twice.
    #[error("{path} is varied twice: give all its values in one list")]
    Twice {
        /// Which.
        path: String,
    },
    /// A template gives no name.
    #[error(transparent)]
    Name(#[from] NameError),
    /// Two pictures have one name.
    #[error("{0}")]
    SameName(String),
}

/// What is varied, and how pictures are called.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The scene file.
    pub scene: PathBuf,
    /// What is changed of it in every picture.
    pub overrides: Vec<Override>,
    /// What is varied.
    pub vary: Vec<Vary>,
    /// Whether the lists go side by side; else all combinations are taken.
    pub zip: bool,
    /// Templates of the outputs' names.
    pub outputs: Vec<String>,
}

impl Sweep {
    /// The pictures; of all combinations the last list runs fastest.
    ///
    /// # Errors
    /// If lists do not go together, or the templates give no name or one name twice.
    pub fn pictures(&self) -> Result<Vec<Picture>, SweepError> {
        for (i, vary) in self.vary.iter().enumerate() {
            if self.vary[..i].iter().any(|other| other.path == vary.path) {
                return Err(SweepError::Twice { path: vary.path.clone() });
            }
        }
        let choices = if self.zip { self.side_by_side()? } else { self.combinations() };
        let pictures = choices.iter().enumerate().map(|(index, choice)| self.picture(index, choice));
        let pictures = pictures.collect::<Result<Vec<_>, _>>()?;
        check_names_differ(&pictures).map_err(SweepError::SameName)?;
        Ok(pictures)
    }

    /// Indices into the lists, one of each list at a time.
    fn side_by_side(&self) -> Result<Vec<Vec<usize>>, SweepError> {
        let Some(first) = self.vary.first() else { return Ok(vec![vec![]]) };
        if let Some(other) = self.vary.iter().find(|vary| vary.values.len() != first.values.len()) {
            return Err(SweepError::Lengths {
                first: first.path.clone(),
                first_count: first.values.len(),
                other: other.path.clone(),
                other_count: other.values.len(),
            });
        }
        Ok((0..first.values.len()).map(|i| vec![i; self.vary.len()]).collect())
    }

    /// Indices into the lists, every one of each with every one of the others.
    fn combinations(&self) -> Vec<Vec<usize>> {
        let mut all = vec![vec![]];
        for vary in &self.vary {
            let longer = all.iter().flat_map(|choice: &Vec<usize>| {
                (0..vary.values.len()).map(move |i| choice.iter().copied().chain([i]).collect())
            });
            all = longer.collect();
        }
        all
    }

    fn picture(&self, index: usize, choice: &[usize]) -> Result<Picture, SweepError> {
        let varied: Vec<Override> = self
            .vary
            .iter()
            .zip(choice)
            .map(|(vary, &i)| Override::new(&vary.path, &vary.values[i]))
            .collect();
        let overrides: Vec<Override> = self.overrides.iter().chain(&varied).cloned().collect();
        let mut variables = Variables::default();
        overrides.iter().for_each(|o| variables.set_path(&o.path, &o.value));
        let scene =
            self.scene.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        variables.set("scene", &scene);
        variables.set("index", index);
        variables.set_from_scene(&self.scene);
        let outputs = self.outputs.iter().map(|template| variables.fill(template).map(PathBuf::from));
        let label: Vec<_> = varied.iter().map(|o| format!("{}={}", last_key(&o.path), o.value)).collect();
        let label = if label.is_empty() { scene.clone() } else { label.join(" ") };
        Ok(Picture {
            name: label.clone(),
            job: scene,
            scene: self.scene.clone(),
            overrides,
            label,
            frame: None,
            outputs: outputs.collect::<Result<_, _>>()?,
        })
    }
}

fn last_key(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

/// `DIRECTORY/SCENE-{a}-{b}.png` for what is varied: the name where none is given.
pub fn default_output(scene: &Path, vary: &[Vary]) -> String {
    let stem = scene.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let keys: String = vary.iter().map(|vary| format!("-{{{}}}", vary.path)).collect();
    format!("{stem}{keys}.png")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(vary: &[&str], zip: bool, output: &str) -> Sweep {
        Sweep {
            scene: "scenes/lemon.toml".into(),
            overrides: vec![Override::new("settings.spp", 4)],
            vary: vary.iter().map(|text| text.parse().unwrap()).collect(),
            zip,
            outputs: vec![output.into()],
        }
    }

    fn names(sweep: &Sweep) -> Vec<String> {
        sweep.pictures().unwrap().iter().map(|p| p.outputs[0].display().to_string()).collect()
    }

    #[test]
    fn lists_are_parted_at_their_own_commas() {
        let vary: Vary = "a.b=1, 10,[1,2],{x=1,y=2},\"p,q\"".parse().unwrap();
        assert_eq!(vary.values, ["1", "10", "[1,2]", "{x=1,y=2}", "\"p,q\""]);
        for bad in ["", "a", "a=", "=1", "a=1,,2", "a=1,"] {
            assert!(bad.parse::<Vary>().is_err(), "{bad}");
        }
    }

    #[test]
    fn all_combinations_or_side_by_side() {
        let lists = ["materials.a.exponent=1,10", "settings.seed=5,6"];
        let output = "{scene}-{exponent}-{seed}-{spp}.png";
        let all = ["lemon-1-5-4.png", "lemon-1-6-4.png", "lemon-10-5-4.png", "lemon-10-6-4.png"];
        assert_eq!(names(&sweep(&lists, false, output)), all);
        assert_eq!(names(&sweep(&lists, true, output)), [all[0], all[3]]);
        assert_eq!(sweep(&lists, true, output).pictures().unwrap()[1].label, "exponent=10 seed=6");
        let vary = &sweep(&lists, true, output).vary;
        assert_eq!(
            default_output(Path::new("d/lemon.toml"), vary),
            "lemon-{materials.a.exponent}-{settings.seed}.png"
        );
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let error = |s: Sweep| s.pictures().unwrap_err().to_string();
        assert!(error(sweep(&["a.b=1,2", "c.d=1"], true, "{index}.png")).contains("a.b has 2 values"));
        assert!(error(sweep(&["a.b=1,2"], false, "same.png")).contains("same.png would be written both"));
        assert!(error(sweep(&["a.b=1", "a.b=2"], false, "{index}.png")).contains("varied twice"));
    }
}
