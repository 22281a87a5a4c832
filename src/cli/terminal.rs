//! Words to the user: results on stdout, everything else on stderr.

use super::exit::{Exit, Failure, OrExit};
use std::io::{ErrorKind, Write, stderr, stdout};

/// A line on stderr. A reader that has gone away is no reason to stop.
pub(super) fn note(line: &str) {
    let _ = writeln!(stderr(), "{line}");
}

/// The result of a subcommand on stdout. A reader that has read enough (`gloss schema | head -1`) is content.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.or_failed(),
    }
}

/// The result as indented JSON.
pub(super) fn print_json(value: &serde_json::Value) -> Result<Exit, Failure> {
    print(&format!("{value:#}\n"))?;
    Ok(Exit::Done)
}

/// A number of bytes for people.
pub(super) fn bytes(n: u64) -> String {
    scaled(n as f64, &["B", "kB", "MB", "GB", "TB"])
}

/// A large number for people.
pub(super) fn count(n: f64) -> String {
    scaled(n, &["", "k", "M", "G", "T"])
}

/// Three or four digits and the unit of the power of 1000.
fn scaled(mut n: f64, units: &[&str]) -> String {
    let mut unit = 0;
    while n >= 999.5 && unit + 1 < units.len() {
        n /= 1000.0;
        unit += 1;
    }
    let digits = if unit == 0 || n >= 99.95 {
        0
    } else if n >= 9.995 {
        1
    } else {
        2
    };
    format!("{n:.digits$} {}", units[unit]).trim_end().to_owned()
}

/// The greatest memory that the process has held so far, in bytes, where the system says it (Linux).
pub(super) fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// What was typed, for a shell.
pub(super) fn typed() -> String {
    let quoted = std::env::args().skip(1).map(|word| {
        let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    });
    ["gloss".to_owned()].into_iter().chain(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        assert_eq!(count(0.0), "0");
        assert_eq!(count(999.0), "999");
        assert_eq!(count(999.7), "1.00 k");
        assert_eq!(count(12_345_678.0), "12.3 M");
        assert_eq!(bytes(1_999_999), "2.00 MB");
        assert_eq!(bytes(123_456_789), "123 MB");
        assert_eq!(bytes(u64::MAX), "18446744 TB");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_peak_memory_is_known() {
        assert!(peak_memory_bytes().unwrap() > 100_000);
    }
}
