//! In which order the rays of a wave are shaded.

use super::powers::Powers;
use crate::bxdf::{Bxdf, LobeKind};
use crate::core::Hit;
use crate::scene::Material;
use glam::Vec3;

/// Rays of one class of a wave, by what they have found: surfaces of a kind together, so that eight of them take the same
/// turns, otherwise in their order, so that neighbours stay neighbours.
#[derive(Default)]
pub(super) struct Order {
    /// Numbers of the rays.
    rays: Vec<u32>,
    /// Where each kind ends.
    ends: [usize; Self::KINDS],
}

impl Order {
    /// The kind of surfaces that reflect nothing.
    pub(super) const BLACK: usize = 0;
    /// The kind of mirrors and of glass.
    const DELTA: usize = 1 + LobeKind::Delta as usize;
    /// The kind of surfaces with a diffuse lobe and nothing else.
    pub(super) const DIFFUSE: usize = 1 + LobeKind::Diffuse as usize;
    /// The kind of rough metals and nothing else.
    pub(super) const METAL: usize = 4;
    /// The kind of plastics and nothing else.
    pub(super) const PLASTIC: usize = 5;
    /// The kind of cosine powers and nothing else.
    pub(super) const POWER: usize = 6;
    /// The kind of surfaces with a diffuse lobe and a cosine power.
    pub(super) const DIFFUSE_AND_POWER: usize = 7;
    /// The kind of surfaces of which none of the others tells.
    pub(super) const OTHER: usize = 8;
    /// The kind of rays that hit nothing.
    pub(super) const MISSED: usize = 9;
    const KINDS: usize = Self::MISSED + 1;

    /// Whether surfaces of a kind may have a diffuse lobe.
    #[inline(always)]
    pub(super) fn may_be_diffuse(kind: usize) -> bool {
        matches!(kind, Self::DIFFUSE | Self::DIFFUSE_AND_POWER | Self::OTHER)
    }

    /// Whether surfaces of a kind may have rays that follow guides.
    #[inline(always)]
    pub(super) fn may_be_guided(kind: usize) -> bool {
        Self::may_be_diffuse(kind) || matches!(kind, Self::METAL | Self::PLASTIC | Self::POWER)
    }

    /// Whether surfaces of a kind may reflect what comes from anywhere.
    #[inline(always)]
    pub(super) fn may_be_wide(kind: usize) -> bool {
        Self::may_be_diffuse(kind) || kind == Self::PLASTIC
    }

    /// Whether surfaces of a kind may have several lobes, of which one is chosen.
    #[inline(always)]
    pub(super) fn may_choose(kind: usize) -> bool {
        matches!(kind, Self::DIFFUSE_AND_POWER | Self::OTHER)
    }

    /// Whether surfaces of a kind may take light from lights.
    #[inline(always)]
    pub(super) fn takes_light(kind: usize) -> bool {
        !matches!(kind, Self::BLACK | Self::DELTA)
    }

    /// Sorts rays by their `hits`, where `kinds` tells of each geometry.
    #[inline(always)]
    pub(super) fn sort(&mut self, hits: &[Option<Hit>], kinds: &[u8]) {
        let kind = |hit: &Option<Hit>| match hit {
            Some(hit) => usize::from(kinds[hit.geom_id as usize]),
            None => Self::MISSED,
        };
        let mut counts = [0; Self::KINDS];
        for hit in hits {
            counts[kind(hit)] += 1;
        }
        let mut before = 0;
        for (end, count) in self.ends.iter_mut().zip(counts) {
            *end = before;
            before += count;
        }
        self.rays.resize(hits.len(), 0);
        for (i, hit) in (0..).zip(hits) {
            let end = &mut self.ends[kind(hit)];
            self.rays[*end] = i;
            *end += 1;
        }
    }

    /// Each kind with its rays.
    #[inline(always)]
    pub(super) fn by_kind(&self) -> impl Iterator<Item = (usize, &[u32])> {
        let mut start = 0;
        self.ends.iter().enumerate().map(move |(kind, &end)| {
            let rays = &self.rays[start..end];
            start = end;
            (kind, rays)
        })
    }
}

/// The kind of surfaces of a material: where colours differ from point to point, the lobes are of one kind still.
pub(super) fn kind_of(material: &Material) -> u8 {
    let kind = match material.bsdf(Vec3::ZERO).lobes() {
        [] => Order::BLACK,
        _ if material.emission.is_some() => Order::OTHER,
        [Bxdf::Conductor(lobe)] if lobe.is_rough() => Order::METAL,
        [Bxdf::Plastic(_)] => Order::PLASTIC,
        [Bxdf::CosinePower(lobe)] if Powers::takes(lobe) => Order::POWER,
        [Bxdf::Diffuse(_), Bxdf::CosinePower(lobe)] if Powers::takes(lobe) => Order::DIFFUSE_AND_POWER,
        [lobe] => 1 + lobe.kind() as usize,
        lobes if lobes.iter().all(|lobe| lobe.kind() == LobeKind::Delta) => Order::DELTA,
        _ => Order::OTHER,
    };
    kind as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_ray_is_in_the_group_of_what_it_hit_and_in_its_order_there() {
        let kinds = [2, 0, 4, 2];
        let hit = |geom_id| Some(Hit { t: 1.0, u: 0.0, v: 0.0, geom_id, prim_id: 0 });
        let hits = [hit(3), None, hit(1), hit(0), hit(2), None, hit(3)];
        let mut order = Order::default();
        // Nothing stays of an earlier, longer wave.
        for wave in [&hits[..], &hits[..4], &hits[..0]] {
            order.sort(wave, &kinds);
            let expected = |kind: usize| -> Vec<u32> {
                let of =
                    |hit: &Option<Hit>| hit.map_or(Order::MISSED, |hit| kinds[hit.geom_id as usize].into());
                (0..).zip(wave).filter(|(_, hit)| of(hit) == kind).map(|(i, _)| i).collect()
            };
            for (kind, rays) in order.by_kind() {
                assert_eq!(rays, expected(kind), "kind {kind} of {} rays", wave.len());
            }
        }
    }
}
