//! The choice among lights, and eight receivers side by side.

use super::*;
use crate::core::{Sampler, SamplerKind, warp};

/// Independent numbers `(choice, u)` in a fixed order.
fn numbers(seed: u32, i: u32) -> (f32, [f32; 2]) {
    let sampler = Sampler::new(SamplerKind::Independent, seed, 0, 0);
    (sampler.single(i, 0), sampler.pair(i, 1))
}

fn direction(seed: u32, i: u32) -> Vec3 {
    warp::uniform_sphere(numbers(seed, i).1)
}

/// Small rectangles, spheres and points all over the cube from -1 to 1, their powers a thousandfold apart.
fn crowd(count: u32) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let (power, [y, z]) = numbers(1, i);
            let p = 2.0 * Vec3::new(numbers(2, i).0, y, z) - 1.0;
            let radiance = Rgb::grey(1000f32.powf(power));
            let (u, v) = (0.01 * direction(3, i), direction(4, i));
            match i % 4 {
                0 => Light::point(p, radiance * 1e-4, true, true),
                1 => Light::sphere(crate::geometry::Sphere { center: p, radius: 0.005 }, radiance, false),
                _ => Light::rectangle(p, u, 0.01 * u.cross(v).normalize(), radiance, i % 8 == 2),
            }
        })
        .collect()
}

fn receivers(count: u32) -> impl Iterator<Item = Receiver> {
    (0..count).map(|i| Receiver {
        p: 1.5 * direction(5, i) * numbers(6, i).0,
        n: direction(7, i),
        rivals: if i % 2 == 0 { Rivals::Lobes } else { Rivals::None },
    })
}

/// The choice for one receiver: the light, its probability, and what is left of the number.
fn choose(lights: &Lights, to: &Receiver, choice: f64) -> Option<(Pick, f64, f64)> {
    let mut receivers = Receivers::default();
    receivers.set(3, to);
    let (picks, probability, u) = lights.choose(&receivers, [[choice; LANES]; 2]);
    picks[3].map(|pick| (pick, probability[3], u[0][3]))
}

/// A number with more bits than f32 has.
fn wide((fine, u): (f32, [f32; 2])) -> f64 {
    widen([fine; LANES], &u.map(|u| [u; LANES]))[0][0]
}

#[test]
fn eight_receivers_get_what_each_would_get_alone() {
    let tube = |turn: f32| {
        let at = |angle: f32, y: f32| Vec3::new(angle.cos(), y, angle.sin()) + 0.5;
        let corners = (0..40).flat_map(|i| {
            let [a, b] = [i, i + 1].map(|i| turn + f32::from(i as u8) * 0.15);
            [at(a, 0.0), at(a, 0.1), at(b, 0.0)]
        });
        let triangles = (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = crate::geometry::TriangleMesh::new(corners.collect(), triangles, vec![], vec![]);
        Light::mesh(std::sync::Arc::new(mesh.expect("it is one")), Rgb::WHITE, true)
    };
    let sky = |image: bool| {
        let pixels = (0..64u8).map(|i| Rgb::grey(f32::from(i % 7))).collect();
        let studio = Environment::product_shot(0.1, 0.0);
        if image { Environment::image(8, 8, pixels, 30.0, 0.1).expect("it is one") } else { studio }
    };
    let scenes = [
        Lights::new(crowd(1), None),
        Lights::new(crowd(2).split_off(1), None),
        Lights::new(crowd(3).split_off(2), None),
        Lights::new(crowd(7), Some(sky(true))),
        Lights::new(crowd(500).into_iter().chain([tube(0.0), tube(1.0)]).collect(), Some(sky(false))),
        Lights::new(vec![tube(0.5)], Some(sky(true))),
    ];
    for (scene, lights) in scenes.iter().enumerate() {
        for group in 0..50 {
            let (mut to, mut fine, mut u) = (Receivers::default(), Floats::default(), [[0.0; LANES]; 2]);
            let all: Vec<_> = receivers(8 * group + 8).skip(8 * group as usize).collect();
            for (lane, receiver) in all.iter().enumerate().filter(|(lane, _)| (lane + 1) % 5 > 0) {
                to.set(lane, receiver);
                (fine[lane], [u[0][lane], u[1][lane]]) = numbers(11, 8 * group + lane as u32);
            }
            let mut eight = EightSamples::default();
            lights.sample_eight(&to, || fine, &u, &mut eight);
            for lane in to.lanes() {
                let alone = lights.sample(&all[lane], fine[lane], u.map(|u| u[lane]));
                assert_eq!(eight.get(lane), alone, "scene {scene}, group {group}, lane {lane}");
            }
            assert!(eight.get(4).is_none(), "scene {scene}: nobody has asked");
        }
    }
}

#[test]
fn probabilities_over_ten_thousand_lights_sum_to_one_and_are_those_of_the_choice() {
    let lights = Lights::new(crowd(10_000), None);
    for (i, to) in receivers(8).enumerate() {
        let of = |light| lights.tree.probability(&to, light);
        let sum: f64 = (0..10_000).map(of).sum();
        // A walk may end where neither side shines on the receiver: what it loses gives no light.
        assert!(sum > 0.95 && sum < 1.0 + 1e-9, "{sum}");
        let mut lost = 0.0;
        for j in 0..2000 {
            let chosen = choose(&lights, &to, wide(numbers(i as u32, j)));
            let Some((Pick::Light(light), probability, rest)) = chosen else {
                lost += 1.0;
                continue;
            };
            assert!((probability / of(light) - 1.0).abs() < 1e-9 && (0.0..1.0).contains(&rest));
        }
        let expected = 2000.0 * (1.0 - sum).max(0.0);
        assert!(lost <= expected + 5.0 * f64::max(expected, 1.0).sqrt(), "{lost} lost, not {expected}");
    }
}

#[test]
fn every_light_is_reachable_from_before_it() {
    let lights = Lights::new(crowd(10_000), None);
    for (i, light) in (0u32..).zip(&lights.lights) {
        let p = match light {
            Light::Rectangle(light) => light.corners()[0] + 0.3 * light.normal(),
            Light::Sphere(light) => light.sphere.center + 0.3 * Vec3::X,
            Light::Point(light) => light.position + 0.3 * Vec3::X,
            _ => unreachable!("the crowd has none"),
        };
        let probability = lights.tree.probability(&Receiver { p, n: Vec3::Y, rivals: Rivals::None }, i);
        assert!(probability > 0.0, "{i}");
    }
}

#[test]
fn lights_are_chosen_as_often_as_their_probability_says() {
    let point = |x: f32| Light::point(Vec3::new(x, 1.0, 0.0), Rgb::WHITE, false, true);
    for far in [0u8, 3, 20] {
        let mut crowd = crowd(60);
        crowd.extend((0..far).map(|x| point(f32::from(x) - 5.0)));
        let count = crowd.len();
        let lights = Lights::new(crowd, (far > 0).then_some(Environment::Constant(Rgb::grey(50.0))));
        for (i, to) in receivers(4).enumerate() {
            let (mut found, mut expected, n) = (vec![0.0; count + 1], vec![0.0; count + 1], 40_000);
            for j in 0..n {
                let chosen = choose(&lights, &to, wide(numbers(i as u32, j)));
                let Some((pick, probability, _)) = chosen else { continue };
                let index = match pick {
                    Pick::Light(light) => light as usize,
                    Pick::Environment => count,
                };
                found[index] += 1.0;
                expected[index] = f64::from(n) * probability;
            }
            // Lights that are expected fewer than 5 times count as one.
            let (mut rare, mut chi_square, mut bins) = ([0.0; 2], 0.0f64, 0.0f64);
            for (found, expected) in found.into_iter().zip(expected) {
                if expected < 5.0 {
                    rare = [rare[0] + found, rare[1] + expected];
                } else {
                    chi_square += (found - expected) * (found - expected) / expected;
                    bins += 1.0;
                }
            }
            assert!((rare[0] - rare[1]).abs() <= 5.0 * f64::max(rare[1], 1.0).sqrt(), "{rare:?}");
            assert!(bins > 2.0 && chi_square < bins + 5.0 * (2.0 * bins).sqrt(), "{chi_square} {bins}");
        }
    }
}

/// Mean and relative standard deviation of the irradiance by sampling.
fn irradiance(lights: &Lights, to: &Receiver, n: u32) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let (choice, u) = numbers(9, i);
        let sample = lights.sample(to, choice, u);
        let x = sample.map_or(0.0, |s| f64::from(s.le_over_pdf.g * s.wi.dot(to.n).max(0.0)));
        sum += x;
        squares += x * x;
    }
    let mean = sum / f64::from(n);
    (mean, (squares / f64::from(n) - mean * mean).sqrt() / mean)
}

#[test]
fn ten_thousand_lights_add_up_with_little_noise() {
    let lights = Lights::new(crowd(10_000), None);
    for to in receivers(4) {
        // 64 samples of each alone.
        let alone = lights.lights.iter().map(|light| Lights::new(vec![light.clone()], None));
        let alone: Vec<f64> = alone.map(|light| irradiance(&light, &to, 64).0).collect();
        let exact: f64 = alone.iter().sum();
        let n = 40_000;
        let (mean, deviation) = irradiance(&lights, &to, n);
        let error = 5.0 * deviation / f64::from(n).sqrt() + 0.01;
        assert!((mean / exact - 1.0).abs() < error, "{mean} is not {exact} +- {error}");
        let evenly = (alone.iter().map(|e| e * e).sum::<f64>() * 1e4).sqrt() / exact;
        assert!(deviation < evenly / 3.0, "{deviation}, evenly {evenly}");
    }
}

#[test]
fn a_broad_environment_is_left_to_lobes_that_look() {
    let lamp = || vec![Light::rectangle(Vec3::Y, Vec3::X, Vec3::Z, Rgb::WHITE, true)];
    let looking = Receiver { p: Vec3::ZERO, n: Vec3::Y, rivals: Rivals::Lobes };
    let alone = Receiver { rivals: Rivals::None, ..looking };
    let broad = Lights::new(lamp(), Some(Environment::Constant(Rgb::WHITE)));
    for choice in [0.0, 0.5, 0.99] {
        assert_eq!(choose(&broad, &looking, choice), Some((Pick::Light(0), 1.0, choice)));
    }
    assert_eq!(broad.pdf_environment(&looking, Vec3::Y), 0.0);
    assert!(broad.pdf_environment(&alone, Vec3::Y) > 0.0);
    assert_eq!(choose(&broad, &alone, 0.99).map(|(pick, ..)| pick), Some(Pick::Environment));
    let sky = Lights::new(vec![], Some(Environment::Constant(Rgb::WHITE)));
    assert!(sky.sample(&looking, 0.5, [0.5; 2]).is_none() && sky.sample(&alone, 0.5, [0.5; 2]).is_some());
    let softboxes = Lights::new(lamp(), Some(Environment::product_shot(1.0, 0.0)));
    let [key_light, cove] = [Vec3::new(-0.75, 0.75, 0.65).normalize(), Vec3::NEG_Y];
    assert!(softboxes.pdf_environment(&looking, key_light) > 0.0);
    assert_eq!(softboxes.pdf_environment(&looking, cove), 0.0);
    assert!(softboxes.pdf_environment(&alone, cove) > 0.0);
}

#[test]
fn one_light_is_asked_always() {
    let rectangle = Light::rectangle(Vec3::Y, Vec3::X, Vec3::Z, Rgb::WHITE, true);
    let dark = Light::rectangle(Vec3::Y, Vec3::X, Vec3::Z, Rgb::BLACK, true);
    let to = Receiver { p: Vec3::ZERO, n: Vec3::Y, rivals: Rivals::None };
    let lights = Lights::new(vec![dark, rectangle], Some(Environment::Constant(Rgb::BLACK)));
    assert_eq!(choose(&lights, &to, 0.7), Some((Pick::Light(1), 1.0, 0.7)));
    assert_eq!(lights.tree.probability(&to, 0), 0.0);
    let sky = Lights::new(vec![], Some(Environment::Constant(Rgb::WHITE)));
    assert_eq!(choose(&sky, &to, 0.7), Some((Pick::Environment, 1.0, 0.7)));
    assert!(choose(&Lights::default(), &to, 0.7).is_none() && Lights::default().is_empty());
}
