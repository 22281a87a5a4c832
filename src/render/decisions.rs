//! What a render has decided from its own samples, so that after a break it goes on as if there had been none.

use super::adaptive::Found;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A block of pixels by its column and row in the grid of blocks; those that share samples out are smaller than those
/// that are judged clean.
pub(super) type Block = (u32, u32);

/// Which round a render is in, and what it has learnt in the rounds before: which blocks of pixels are clean, and
/// where there is noise.
///
/// Together with the film, it is all that the samples still to come depend on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Decisions {
    /// Samples per pixel at the end of the round in work; 0 before the first.
    pub(super) target: u32,
    /// What the first samples have found, block by block, where samples are shared out.
    #[serde(with = "pairs", default)]
    pub(super) found: BTreeMap<Block, Found>,
    /// Blocks that get no more samples.
    pub(super) clean: BTreeSet<Block>,
    /// Blocks that were below the threshold at the end of the last round.
    pub(super) below_once: BTreeSet<Block>,
}

/// A map as a list of pairs: JSON has texts only as keys.
mod pairs {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::collections::BTreeMap;

    pub(super) fn serialize<K: Serialize, V: Serialize, S: Serializer>(
        map: &BTreeMap<K, V>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(map)
    }

    pub(super) fn deserialize<'de, K: Deserialize<'de> + Ord, V: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<BTreeMap<K, V>, D::Error> {
        Ok(Vec::<(K, V)>::deserialize(deserializer)?.into_iter().collect())
    }
}
