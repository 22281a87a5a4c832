//! Values of flags: from what is typed to what is meant.

use super::farm_args::ShardFlag;
use crate::film::PixelRect;
use crate::scene::settings::Auto;
use crate::scene::{GlossySamples, LightCandidates, Override};
use std::num::NonZeroU32;
use std::time::Duration;

/// `640x480`.
pub(super) fn resolution(typed: &str) -> Result<[u32; 2], String> {
    let (width, height) = typed.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, such as 640x480")?;
    let side = |s: &str| match s.parse::<u32>() {
        Ok(n) if (1..=65_536).contains(&n) => Ok(n),
        _ => Err(format!("`{s}` is not a number of pixels from 1 to 65536")),
    };
    Ok([side(width)?, side(height)?])
}

/// `x0,y0,x1,y1`, the last two exclusive.
pub(super) fn crop(typed: &str) -> Result<PixelRect, String> {
    let numbers: Result<Vec<u32>, _> = typed.split(',').map(|s| s.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(PixelRect { x0, y0, x1, y1 }),
        Ok([_, _, _, _]) => Err("the crop is empty: it needs x0 < x1 and y0 < y1".to_owned()),
        _ => Err("write it as X0,Y0,X1,Y1 in pixels from the upper left, such as 0,0,320,240".to_owned()),
    }
}

/// `16`, `16,4,1`, `any=4`, `branch=9` or `auto`.
pub(super) fn glossy_samples(typed: &str) -> Result<GlossySamples, String> {
    let rays = |s: &str| {
        s.trim().parse().map(NonZeroU32::get).map_err(|_| format!("`{s}` is not a number of rays from 1 up"))
    };
    if typed == "auto" {
        return Ok(GlossySamples::Auto(Auto::Auto));
    }
    if let Some(any) = typed.strip_prefix("any=") {
        return Ok(GlossySamples::Any { any: rays(any)? });
    }
    if let Some(branch) = typed.strip_prefix("branch=") {
        return Ok(GlossySamples::Branch { branch: rays(branch)? });
    }
    let list = typed.split(',').map(rays).collect::<Result<Vec<_>, _>>()?;
    Ok(match list[..] {
        [first] => GlossySamples::First(first),
        _ => GlossySamples::PerDepth(list),
    })
}

/// A number of candidates for samples of lights, or `auto`.
pub(super) fn light_candidates(typed: &str) -> Result<LightCandidates, String> {
    if typed == "auto" {
        return Ok(LightCandidates::Auto(Auto::Auto));
    }
    let count = typed.parse().ok().filter(|n| (1..=LightCandidates::MOST).contains(n));
    let message = || format!("it is a number of candidates from 1 to {}, or auto", LightCandidates::MOST);
    count.map(LightCandidates::Fixed).ok_or_else(message)
}

/// A radiance above 0.
pub(super) fn radiance(typed: &str) -> Result<f32, String> {
    match typed.parse::<f32>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err("it is a radiance above 0, such as 10".to_owned()),
    }
}

/// A factor of lengths above 0.
pub(super) fn scale(typed: &str) -> Result<f32, String> {
    match typed.parse::<f32>() {
        Ok(x) if (0.01..=16.0).contains(&x) => Ok(x),
        _ => Err("it is a number from 0.01 to 16".to_owned()),
    }
}

/// `path.to.key=value`.
pub(super) fn definition(typed: &str) -> Result<Override, String> {
    match typed.split_once('=') {
        Some((path, value)) if !path.trim().is_empty() => {
            Ok(Override { path: path.trim().to_owned(), value: value.trim().to_owned() })
        }
        _ => Err("write it as path.to.key=value, such as settings.seed=7".to_owned()),
    }
}

/// An edge of tiles: 0, or a multiple of 8.
pub(super) fn tile_size(typed: &str) -> Result<u32, String> {
    match typed.parse::<u32>() {
        Ok(n) if n.is_multiple_of(8) && n <= 4096 => Ok(n),
        _ => Err("it is a multiple of 8 up to 4096, or 0 for the default".to_owned()),
    }
}

/// `I/N`, `auto` or `auto/N`.
pub(super) fn shard(typed: &str) -> Result<ShardFlag, String> {
    const FORM: &str = "write it as I/N from 0/N on, such as 3/8, or auto, or auto/N";
    let (index, count) = match typed.split_once('/') {
        Some((index, count)) => (index, Some(count.parse::<u32>().map_err(|_| FORM)?)),
        None => (typed, None),
    };
    match (index, count) {
        ("auto", None) => Ok(ShardFlag::Auto(None)),
        (_, Some(0)) => Err("there must be at least one shard".to_owned()),
        ("auto", count) => Ok(ShardFlag::Auto(count)),
        (index, Some(count)) => Ok(ShardFlag::Number(index.parse().map_err(|_| FORM)?, count)),
        (_, None) => Err(FORM.to_owned()),
    }
}

/// A time: `90s`, `5m`, `1.5h`, or seconds without a unit.
pub(super) fn duration(typed: &str) -> Result<Duration, String> {
    let at = typed.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(typed.len());
    let unit = match &typed[at..] {
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("a time ends in ms, s, m or h, such as 90s".to_owned()),
    };
    match typed[..at].trim().parse::<f64>() {
        Ok(number) if (0.0..=1e9).contains(&number) => Ok(Duration::from_secs_f64(number * unit)),
        _ => Err("write a time as a number and its unit, such as 90s, 5m or 1.5h".to_owned()),
    }
}

/// A number of bytes: `500MB`, `2GB`, `0`.
pub(super) fn bytes(typed: &str) -> Result<usize, String> {
    let at = typed.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(typed.len());
    let unit = match typed[at..].to_ascii_uppercase().as_str() {
        "" | "B" => 1.0,
        "KB" | "K" => 1e3,
        "MB" | "M" => 1e6,
        "GB" | "G" => 1e9,
        _ => return Err("memory is given in kB, MB or GB, such as 2GB".to_owned()),
    };
    match typed[..at].trim().parse::<f64>() {
        Ok(number) if (0.0..=1e12).contains(&(number * unit)) => Ok((number * unit) as usize),
        _ => Err("write memory as a number and its unit, such as 500MB or 2GB".to_owned()),
    }
}

/// A number from `low` to `high`.
fn number_between(typed: &str, low: f32, high: f32) -> Result<f32, String> {
    match typed.parse::<f32>() {
        Ok(n) if (low..=high).contains(&n) => Ok(n),
        _ => Err(format!("it is a number from {low} to {high}")),
    }
}

/// Stops of exposure.
pub(super) fn exposure(typed: &str) -> Result<f32, String> {
    number_between(typed, -64.0, 64.0)
}

/// A relative error.
pub(super) fn noise(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(n) if n > 0.0 && n < 1.0 => Ok(n),
        _ => Err("it is a relative error between 0 and 1, such as 0.02".to_owned()),
    }
}

/// Pixels per degree.
pub(super) fn ppd(typed: &str) -> Result<f32, String> {
    number_between(typed, 1.0, 1000.0)
}

/// A threshold.
pub(super) fn threshold(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(n) if n >= 0.0 => Ok(n),
        _ => Err("it is a number from 0 up".to_owned()),
    }
}

/// An error above 0.
pub(super) fn error(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(n) if n > 0.0 && n.is_finite() => Ok(n),
        _ => Err("it is a number above 0, such as 0.001".to_owned()),
    }
}

/// A fraction.
pub(super) fn fraction(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(n) if (0.0..=1.0).contains(&n) => Ok(n),
        _ => Err("it is a number from 0 to 1".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_is_what_is_meant() {
        assert_eq!(resolution("640x480"), Ok([640, 480]));
        assert_eq!(crop("0, 1,2,30"), Ok(PixelRect { x0: 0, y0: 1, x1: 2, y1: 30 }));
        assert_eq!(glossy_samples("16"), Ok(GlossySamples::First(16)));
        assert_eq!(glossy_samples("16,4"), Ok(GlossySamples::PerDepth(vec![16, 4])));
        assert_eq!(glossy_samples("any=4"), Ok(GlossySamples::Any { any: 4 }));
        assert_eq!(glossy_samples("branch=9"), Ok(GlossySamples::Branch { branch: 9 }));
        assert_eq!(glossy_samples("auto"), Ok(GlossySamples::Auto(Auto::Auto)));
        assert_eq!(light_candidates("auto"), Ok(LightCandidates::Auto(Auto::Auto)));
        assert_eq!(light_candidates("4"), Ok(LightCandidates::Fixed(4)));
        assert!(["0", "65", "-1", "many"].iter().all(|bad| light_candidates(bad).is_err()));
        let defined = definition("shapes.0.file=a=b.obj").unwrap();
        assert_eq!((&*defined.path, &*defined.value), ("shapes.0.file", "a=b.obj"));
        assert_eq!(tile_size("64"), Ok(64));
        assert_eq!(shard("3/8"), Ok(ShardFlag::Number(3, 8)));
        assert_eq!(shard("auto/8"), Ok(ShardFlag::Auto(Some(8))));
        assert_eq!(shard("auto"), Ok(ShardFlag::Auto(None)));
        assert_eq!(duration("1.5h"), Ok(Duration::from_secs(5400)));
        assert_eq!(duration("250ms"), Ok(Duration::from_millis(250)));
        assert_eq!(noise("0.02"), Ok(0.02));
        assert_eq!(bytes("1.5GB"), Ok(1_500_000_000));
        assert_eq!(bytes("0"), Ok(0));
        assert_eq!(duration("7"), Ok(Duration::from_secs(7)));
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        assert_eq!(threshold("inf"), Ok(f64::INFINITY));
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in ["", "640", "640x", "x480", "0x4", "640x-1", "640x480x3", "99999x1", "1.5x2"] {
            assert!(resolution(bad).is_err(), "{bad}");
        }
        for bad in ["", "1,2,3", "1,2,3,4,5", "1,1,1,2", "-1,0,2,2", "2,0,1,1", "a,b,c,d"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        for bad in ["", "0", "-1", "4,0", "4,", "branch=", "branch=0", "many"] {
            assert!(glossy_samples(bad).is_err(), "{bad}");
        }
        for bad in ["", "key", "=1", " =1"] {
            assert!(definition(bad).is_err(), "{bad}");
        }
        for bad in ["", "3", "3/", "/8", "3/0", "auto/0", "auto/x", "a/8"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
        for bad in ["", "0", "1", "-0.1", "nan", "2%"] {
            assert!(noise(bad).is_err(), "{bad}");
        }
        for bad in ["", "GB", "-1", "1TB", "1e30"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
        for bad in ["", "s", "-1s", "5 days", "1e300h", "nan"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
        for bad in ["7", "-8", "8192", ""] {
            assert!(tile_size(bad).is_err(), "{bad}");
        }
        for bad in ["nan", "inf", "65", "x", ""] {
            assert!(exposure(bad).is_err(), "{bad}");
        }
        assert!(ppd("0").is_err() && ppd("nan").is_err() && ppd("1e9").is_err());
        assert!(error("0").is_err() && error("inf").is_err() && error("x").is_err());
        assert!(threshold("-1").is_err() && threshold("nan").is_err());
        assert!(fraction("1.5").is_err() && fraction("-0.1").is_err() && fraction("nan").is_err());
    }
}
