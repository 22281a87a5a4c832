//! Findings as a table for other programs: a line per way, RFC 4180.

use super::findings::{Findings, Found};

/// The columns.
const HEAD: &str = "way,spp,cpu_seconds,cpu_low,cpu_high,wall_seconds,relmse,relmse_low,relmse_high,noise,bias,bias_low,\
bias_high,brightness,flip,flip_low,flip_high,verdict,efficiency,relative_efficiency,rays,memory_bytes,build_seconds,on_front,\
dominated_by";

/// The table.
pub fn to_csv(findings: &Findings) -> String {
    let line = |f: &Found| {
        let e = &f.errors;
        let numbers = |all: &[f64]| all.iter().map(|x| format!("{x:.6e}")).collect::<Vec<_>>().join(",");
        let beaten = f.dominated_by.map_or(String::new(), |by| quoted(&findings.ways[by].way.name));
        format!(
            "{},{},{},{},{},{},{},{:.6e},{},{}\n",
            quoted(&f.way.name),
            numbers(&[f.cost.spp, f.cpu_seconds.median, f.cpu_seconds.mean.low, f.cpu_seconds.mean.high]),
            numbers(&[f.wall_seconds.median, e.relmse.value, e.relmse.low, e.relmse.high, e.noise.value]),
            numbers(&[e.bias.value, e.bias.low, e.bias.high, e.brightness.value]),
            numbers(&[f.flip.value, f.flip.low, f.flip.high]),
            f.verdict.name(),
            numbers(&[f.efficiency, f.relative_efficiency]),
            f.cost.rays as f64,
            numbers(&[f.cost.memory_bytes as f64, f.cost.build_seconds]),
            format_args!("{},{beaten}", f.on_front)
        )
    };
    format!("{HEAD}\n{}", findings.ways.iter().map(line).collect::<String>())
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
