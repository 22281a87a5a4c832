//! What has been measured so far, and its file: a line of JSON, then numbers.

use super::catalogue::Catalogue;
use super::estimate::{Reference, Sums};
use super::run::Shot;
use crate::core::Rgb;
use crate::image_io::write_atomically;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

/// What one picture cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// CPU seconds of all threads.
    pub cpu_seconds: f64,
    /// Wall seconds.
    pub wall_seconds: f64,
    /// Rays of all classes.
    pub rays: u64,
    /// Mean number of samples that the pixels got.
    pub spp: f64,
    /// Bytes of the structure that answers rays.
    pub memory_bytes: u64,
    /// Wall seconds in which that structure was built.
    pub build_seconds: f64,
    /// Mean throughput per camera sample that was cut off at the greatest depth.
    pub lost_throughput: f64,
}

/// What was measured of one way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// Its pictures.
    pub sums: Sums,
    /// What each cost.
    pub costs: Vec<Cost>,
    /// The first of them as they are, [`KEPT`] at most.
    pub pictures: Vec<Vec<Rgb>>,
}

/// Pictures that are kept of each way, for FLIP.
pub const KEPT: usize = 4;

impl Measured {
    /// Adds a picture.
    pub fn add(&mut self, shot: &Shot) {
        self.sums.add(&shot.pixels);
        self.costs.push(shot.cost);
        if self.pictures.len() < KEPT {
            self.pictures.push(shot.pixels.clone());
        }
    }
}

/// A run in work.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Of what and how it is: another identity is another run.
    pub identity: String,
    /// Columns and rows.
    pub resolution: [u32; 2],
    /// What is measured.
    pub catalogue: Catalogue,
    /// What is taken for the truth.
    pub reference: Reference,
    /// Pictures of the reference.
    pub reference_shots: u32,
    /// Samples per pixel of the reference.
    pub reference_spp: u32,
    /// Rounds done.
    pub rounds: u32,
    /// Wall seconds that it took.
    pub seconds: f64,
    /// Of each way.
    pub measured: Vec<Measured>,
}

/// The part of a state that is JSON.
#[derive(Serialize, Deserialize)]
struct Head {
    gloss_trade_state: u32,
    identity: String,
    resolution: [u32; 2],
    catalogue: Catalogue,
    reference_shots: u32,
    reference_spp: u32,
    rounds: u32,
    seconds: f64,
    half_counts: [u32; 2],
    costs: Vec<Vec<Cost>>,
    kept: Vec<usize>,
}

/// Version of the file.
const VERSION: u32 = 1;

impl State {
    /// A run of which nothing is done.
    pub fn new(identity: String, resolution: [u32; 2], catalogue: Catalogue) -> Self {
        let measured = vec![Measured::default(); catalogue.ways.len()];
        Self {
            identity,
            resolution,
            catalogue,
            reference: Reference::default(),
            reference_shots: 0,
            reference_spp: 0,
            rounds: 0,
            seconds: 0.0,
            measured,
        }
    }

    /// Takes a way out that cannot be had.
    pub(super) fn leave_out(&mut self, way: usize, why: &str) {
        self.catalogue.leave_out(way, why);
        self.measured.remove(way);
    }

    /// Writes it whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let head = Head {
            gloss_trade_state: VERSION,
            identity: self.identity.clone(),
            resolution: self.resolution,
            catalogue: self.catalogue.clone(),
            reference_shots: self.reference_shots,
            reference_spp: self.reference_spp,
            rounds: self.rounds,
            seconds: self.seconds,
            half_counts: self.reference.halves.each_ref().map(|half| half.count),
            costs: self.measured.iter().map(|m| m.costs.clone()).collect(),
            kept: self.measured.iter().map(|m| m.pictures.len()).collect(),
        };
        let head = serde_json::to_string(&head).map_err(|e| e.to_string())?;
        let written = write_atomically(path, |file| {
            let told = |e: std::io::Error| e.to_string();
            let mut out = std::io::BufWriter::new(file);
            writeln!(out, "{head}").map_err(told)?;
            let measured = self.measured.iter().map(|m| &m.sums);
            for sums in self.reference.halves.iter().chain(measured) {
                for x in sums.sum.iter().chain(&sums.square) {
                    out.write_all(&x.to_le_bytes()).map_err(told)?;
                }
            }
            for pixel in self.measured.iter().flat_map(|m| &m.pictures).flatten() {
                for x in pixel.to_array() {
                    out.write_all(&x.to_le_bytes()).map_err(told)?;
                }
            }
            out.flush().map_err(told)
        });
        written.map_err(|e| e.to_string())
    }

    /// Reads what [`write`](Self::write) wrote.
    ///
    /// # Errors
    /// If the file is missing, cut short or none of these.
    pub fn read(path: &Path) -> Result<Self, String> {
        let told = |e: std::io::Error| format!("{}: {e}", path.display());
        let mut file = BufReader::new(std::fs::File::open(path).map_err(told)?);
        let mut line = String::new();
        file.read_line(&mut line).map_err(told)?;
        let head: Head = serde_json::from_str(&line)
            .map_err(|e| format!("{}: not the state of `gloss trade`: {e}", path.display()))?;
        let [width, height] = head.resolution;
        let pixels = width as usize * height as usize;
        let ways = head.catalogue.ways.len();
        if head.gloss_trade_state != VERSION || [head.costs.len(), head.kept.len()] != [ways; 2] {
            return Err(format!("{}: the state of another version of gloss", path.display()));
        }
        let mut numbers = |count: u32| -> Result<Sums, std::io::Error> {
            let mut read = || read_f64s(&mut file, if count == 0 { 0 } else { 3 * pixels });
            Ok(Sums { count, sum: read()?, square: read()? })
        };
        let [a, b] = head.half_counts;
        let halves = [numbers(a).map_err(told)?, numbers(b).map_err(told)?];
        let mut measured = vec![];
        for costs in head.costs {
            let sums = numbers(costs.len() as u32).map_err(told)?;
            measured.push(Measured { sums, costs, pictures: vec![] });
        }
        for (measured, kept) in measured.iter_mut().zip(head.kept) {
            for _ in 0..kept.min(KEPT) {
                measured.pictures.push(read_picture(&mut file, pixels).map_err(told)?);
            }
        }
        Ok(Self {
            identity: head.identity,
            resolution: head.resolution,
            catalogue: head.catalogue,
            reference: Reference { halves },
            reference_shots: head.reference_shots,
            reference_spp: head.reference_spp,
            rounds: head.rounds,
            seconds: head.seconds,
            measured,
        })
    }
}

fn read_f64s(file: &mut impl Read, count: usize) -> std::io::Result<Vec<f64>> {
    let mut bytes = vec![0; 8 * count];
    file.read_exact(&mut bytes)?;
    Ok(bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect())
}

fn read_picture(file: &mut impl Read, pixels: usize) -> std::io::Result<Vec<Rgb>> {
    let mut bytes = vec![0; 12 * pixels];
    file.read_exact(&mut bytes)?;
    let channel = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(bytes
        .chunks_exact(12)
        .map(|b| Rgb::new(channel(&b[0..4]), channel(&b[4..8]), channel(&b[8..12])))
        .collect())
}
