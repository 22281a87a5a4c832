//! One suite for every backend in every mode: what the trait `Accelerator` promises.
//!
//! `subject` is a backend with its options, `scenes` makes shapes and rays, `oracle` holds answers against
//! brute force in f64, and each other module has the cases of one promise. A new backend or option is one line in
//! the list of subjects at the end of this file; it then runs every case.

mod batch;
mod empty;
mod extreme;
mod ids;
mod interval;
mod oracle;
mod random;
mod scenes;
mod skip;
mod sphere;
mod subject;
mod watertight;

#[cfg(feature = "embree")]
use gloss::accel::EmbreeMode;
use gloss::accel::bvh::Isa;
use gloss::accel::{Backend, Quality};
use subject::Subject;

/// Every case, for the subject that the expression makes.
macro_rules! cases {
    ($subject:expr; $($module:ident::$case:ident,)*) => {
        $(
            #[test]
            fn $case() {
                crate::$module::$case(&$subject);
            }
        )*
    };
}

/// A module of tests for each subject: the promises of every build, then those of a robust one.
macro_rules! conformance {
    ($($name:ident = $subject:expr;)*) => {
        $(
            mod $name {
                use super::*;
                every_build!($subject);
                robust_build!($subject);
            }
        )*
    };
}

/// As `conformance`, for builds that are not robust; brute force is always robust.
macro_rules! conformance_without_robustness {
    ($($name:ident = $subject:expr;)*) => {
        $(
            mod $name {
                use super::*;
                every_build!($subject.not_robust());
            }
        )*
    };
}

macro_rules! every_build {
    ($subject:expr) => {
        cases! { $subject;
            empty::a_scene_of_nothing_is_never_hit,
            empty::shapes_without_primitives_keep_their_ids,
            empty::inactive_rays_hit_nothing,
            empty::inactive_rays_do_not_disturb_their_neighbours,
            interval::hits_lie_in_the_interval,
            interval::the_ends_cut_where_they_should,
            interval::an_end_beyond_the_first_surface_finds_the_second,
            extreme::triangles_without_area_are_never_hit,
            extreme::coincident_triangles_give_either,
            ids::hits_name_the_triangle_and_its_point,
            ids::long_and_short_directions_scale_t,
            sphere::spheres_are_hit_from_outside_and_inside,
            sphere::tangents_are_the_border_of_hits,
            skip::a_primitive_is_skipped,
            skip::a_geometry_is_skipped,
            skip::rules_of_neighbours_do_not_mix,
            skip::a_skipped_sphere_is_not_hit_from_inside,
            skip::without_rules_nothing_changes,
            batch::order_changes_nothing,
            batch::occluded_is_whether_anything_is_hit,
            batch::threads_share_a_scene,
            random::random_triangles_agree_with_brute_force,
            random::random_spheres_agree_with_brute_force,
            random::mixed_shapes_agree_with_brute_force,
            random::a_smooth_mesh_agrees_with_brute_force,
        }
    };
}

macro_rules! robust_build {
    ($subject:expr) => {
        cases! { $subject;
            watertight::no_ray_leaves_a_closed_mesh,
            watertight::rays_at_vertices_and_edges_hit,
            extreme::scale_changes_nothing,
            extreme::slivers_are_hit_where_they_are,
            extreme::grazed_slivers_are_hit_where_they_are,
            batch::any_length_answers_alike,
            batch::a_wrong_hint_changes_nothing,
        }
    };
}

conformance! {
    brute = Subject::new(Backend::Brute).rays(2_000);
    bvh = Subject::new(Backend::Bvh).rays(1_000_000);
    bvh_fast = Subject::new(Backend::Bvh).quality(Quality::Fast);
    bvh_high = Subject::new(Backend::Bvh).quality(Quality::High);
    bvh_portable = Subject::bvh_on(Isa::Portable);
}

conformance_without_robustness! {
    bvh_not_robust = Subject::new(Backend::Bvh);
    bvh_high_not_robust = Subject::new(Backend::Bvh).quality(Quality::High);
    bvh_portable_not_robust = Subject::bvh_on(Isa::Portable);
}

#[cfg(target_arch = "x86_64")]
conformance! {
    bvh_sse2 = Subject::bvh_on(Isa::Sse2);
}

#[cfg(feature = "embree")]
conformance! {
    embree_auto = Subject::embree(EmbreeMode::Auto).rays(1_000_000);
    embree_auto_compact = Subject::embree(EmbreeMode::Auto).compact();
    embree_auto_fast = Subject::embree(EmbreeMode::Auto).quality(Quality::Fast);
    embree_auto_high = Subject::embree(EmbreeMode::Auto).quality(Quality::High);
    embree_single = Subject::embree(EmbreeMode::Single);
    embree_packet4 = Subject::embree(EmbreeMode::Packet4);
    embree_packet8 = Subject::embree(EmbreeMode::Packet8);
    embree_packet8_compact = Subject::embree(EmbreeMode::Packet8).compact();
    embree_packet16 = Subject::embree(EmbreeMode::Packet16);
    embree_stream = Subject::embree(EmbreeMode::Stream);
    embree_stream_compact = Subject::embree(EmbreeMode::Stream).compact();
}

#[cfg(feature = "embree")]
conformance_without_robustness! {
    embree_auto_not_robust = Subject::embree(EmbreeMode::Auto);
    embree_single_not_robust = Subject::embree(EmbreeMode::Single);
    embree_packet8_not_robust = Subject::embree(EmbreeMode::Packet8);
    embree_stream_not_robust = Subject::embree(EmbreeMode::Stream);
}
