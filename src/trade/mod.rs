//! What each shortcut costs and saves, measured on the user's own scene.
//!
//! A [`Catalogue`] lists ways to render: a base that loses no light, and knobs that each change one thing of it. A
//! [`run()`] has a [`Workbench`] take pictures of them: first a reference, then every way in turn, round by round, each
//! time with another seed. [`Findings`] say of each way what it costs, how much of its error is noise and how much
//! bias, which ways no other beats, and which to take for a given error or time ([`Advice`]).
//!
//! Read [`catalogue`], [`run`](mod@run), then [`estimate`], where errors are taken apart; [`bench`](mod@bench) is the workbench that
//! really renders, [`state`] what a run that was broken off goes on from; [`text`], [`csv`] and [`page`] tell it.

pub mod advice;
pub mod bench;
pub mod catalogue;
pub mod chart;
pub mod csv;
pub mod estimate;
pub mod findings;
pub mod knob;
pub mod page;
pub mod run;
pub mod state;
pub mod text;
pub mod way;

pub use advice::{Advice, Target};
pub use bench::Bench;
pub use catalogue::Catalogue;
pub use findings::Findings;
pub use knob::Knob;
pub use run::{Options, Shot, Stopped, Task, Workbench, run};
pub use state::State;
pub use way::{Engine, Way};
