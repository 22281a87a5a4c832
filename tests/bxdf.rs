//! The lobes against closed forms, against each other and at the extremes.
//!
//! A new lobe is added to `bxdf/lobes.rs` once; every test in `bxdf/sweep.rs` then runs over it.

#[path = "bxdf/arvo.rs"]
mod arvo;
#[path = "bxdf/closed_form.rs"]
mod closed_form;
#[path = "bxdf/cosine_power.rs"]
mod cosine_power;
#[path = "bxdf/extreme.rs"]
mod extreme;
#[path = "bxdf/fresnel.rs"]
mod fresnel;
#[path = "bxdf/lobes.rs"]
mod lobes;
#[path = "bxdf/microfacet.rs"]
mod microfacet;
#[path = "bxdf/oracle.rs"]
mod oracle;
#[path = "bxdf/stat.rs"]
mod stat;
#[path = "bxdf/sweep.rs"]
mod sweep;
