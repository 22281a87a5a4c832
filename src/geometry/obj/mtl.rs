//! Material libraries.

use super::ObjMaterial;
use crate::geometry::file_error::{Fault, Place};
use crate::geometry::number::{Cursor, excerpt};

/// Reads the materials of an MTL file in their order, and says what was left out.
pub(super) fn parse(bytes: &[u8]) -> Result<(Vec<ObjMaterial>, Vec<String>), Fault> {
    let (mut materials, mut warnings) = (Vec::<ObjMaterial>::new(), Vec::new());
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for (number, line) in (1..).zip(bytes.split(|&b| b == b'\n')) {
        let line = line.trim_ascii();
        let keyword = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, value) = (&line[..keyword], line[keyword..].trim_ascii());
        if keyword == b"newmtl" {
            let name = String::from_utf8_lossy(value).into_owned();
            materials.push(ObjMaterial { name, ..ObjMaterial::default() });
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        let fault = |mend: &'static str| {
            Fault::new(Place::Line(number), format!("{} is not what is due", excerpt(value)), mend)
        };
        let mut warn = |what: String| {
            let name = excerpt(material.name.as_bytes());
            warnings.push(format!("material {name}: {what}"));
        };
        match keyword {
            b"Ka" | b"Kd" | b"Ks" | b"Ke" => {
                if value.starts_with(b"spectral") || value.starts_with(b"xyz") {
                    warn(format!("the colour {} is not used: give red, green and blue", excerpt(value)));
                    continue;
                }
                let colour = colour(value).ok_or_else(|| fault("a colour is one number or three"))?;
                match keyword {
                    b"Ka" => material.ambient = Some(colour),
                    b"Kd" => material.diffuse = Some(colour),
                    b"Ks" => material.specular = Some(colour),
                    _ => material.emission = Some(colour),
                }
            }
            b"Ns" => match numbers(value).as_deref() {
                Some([exponent]) => material.exponent = Some(*exponent),
                _ => return Err(fault("an exponent is `Ns` and one number")),
            },
            _ if keyword.starts_with(b"map_") => warn(format!("the texture {} is not used", excerpt(value))),
            _ => {}
        }
    }
    Ok((materials, warnings))
}

/// One number for grey, or red, green and blue.
fn colour(value: &[u8]) -> Option<[f32; 3]> {
    match *numbers(value)? {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

/// All numbers of a line; `None` if one is no finite number.
fn numbers(value: &[u8]) -> Option<Vec<f32>> {
    let mut cursor = Cursor::new(value, 0);
    let mut numbers = Vec::new();
    while !cursor.at_line_end() {
        numbers.push(cursor.float().map(|x| x as f32).filter(|x| x.is_finite())?);
        cursor.skip_blanks();
        if cursor.peek() == b'#' {
            break;
        }
    }
    Some(numbers)
}
