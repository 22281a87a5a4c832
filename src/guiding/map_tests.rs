use super::*;

fn map_of(photons: Vec<Photon>) -> GuideMap {
    GuideMap::new(photons, Making { most: 64, counts_dark: false, cell: Cell::to_caustics })
}

/// Photons on a floor, evenly over the unit square, all from one direction.
fn floor(count: usize, power: f32, other: f32) -> Vec<Photon> {
    let photon = |i: usize| {
        let x = (i as f64 * 0.754_877_666_246_692_8).fract() as f32;
        let z = (i as f64 * 0.569_840_290_998_053_3).fract() as f32;
        let wi = Vec3::new(0.6, 0.8, 0.0);
        Photon { p: Vec3::new(x, 0.0, z), n: Vec3::Y, wi, power, other: Some(other), pdf: 0.0 }
    };
    (0..count).map(photon).collect()
}

/// The cell at one point, from lanes of which each has another.
fn find(map: &GuideMap, p: Vec3, n: Vec3) -> Option<u32> {
    let (mut points, mut normals) = (Vectors::default(), Vectors::default());
    for lane in 0..LANES {
        points.set(lane, if lane == 5 { p } else { Vec3::splat(0.1 * lane as f32) });
        normals.set(lane, if lane == 5 { n } else { Vec3::Y });
    }
    map.find(&points, &normals)[5]
}

#[test]
fn the_share_of_guided_rays_goes_by_irradiance() {
    // An irradiance of 1.5 or 3 by caustics, of pi times `other` by all else; half of the rays look for it even
    // where there is nothing.
    for (caustic, other) in [(1.5, 1.0), (3.0, 2.0), (3.0, 0.0)] {
        let map = map_of(floor(4096, caustic / 4096.0, other));
        let share = (SPREAD * caustic / (SPREAD * caustic + other * PI)).min(GREATEST_SHARE);
        let mean = map.cells.iter().map(|cell| cell.share).sum::<f32>() / map.cells.len() as f32;
        assert!(map.cells.len() >= 64, "{} cells", map.cells.len());
        assert!((mean - share).abs() < 0.05, "{mean} instead of {share}");
        assert!(map.cells.iter().all(|cell| cell.share <= GREATEST_SHARE));
    }
}

#[test]
fn a_point_finds_the_cell_that_its_photons_are_in() {
    let photons = floor(4096, 1.0, 0.1);
    let map = map_of(photons.clone());
    for photon in &photons {
        let cell = find(&map, photon.p, photon.n).expect("there are photons here");
        assert!(map.bounds[cell as usize].contains(photon.p));
        assert!(map.cell(cell).mixture.pdf(photon.p, photon.wi) > 10.0);
    }
    // From below, beside it, and above it there is no caustic.
    assert_eq!(find(&map, Vec3::new(0.5, 0.0, 0.5), -Vec3::Y), None);
    assert_eq!(find(&map, Vec3::new(-1.0, 0.0, 0.5), Vec3::Y), None);
    assert_eq!(find(&map, Vec3::new(0.5, 0.5, 0.5), Vec3::Y), None);
}

#[test]
fn photons_that_tell_nothing_make_no_cell() {
    assert!(map_of(vec![]).is_empty());
    // A single point has no area, and faint caustics are not worth a ray.
    assert!(map_of(vec![floor(1, 1.0, 0.1)[0]; 100]).is_empty());
    assert!(map_of(floor(1000, 1e-9, 1.0)).is_empty());
    let unlooked = floor(1000, 1.0, 0.1).into_iter().map(|photon| Photon { other: None, ..photon });
    assert!(map_of(unlooked.collect()).is_empty());
    assert!(map_of(floor(1000, f32::NAN, 1.0)).is_empty());
}
