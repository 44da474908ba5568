//! Lambert, glass and metal against what is known of them.

use super::*;

#[test]
fn roughness_zero_is_lambert() {
    let bsdf = Bsdf::from(Diffuse::new(Rgb::new(0.2, 0.5, 0.9), 0.0));
    let wi = Vec3A::new(0.6, 0.0, 0.8);
    assert!((bsdf.eval(&frame(), Vec3A::Z, wi) - Rgb::new(0.2, 0.5, 0.9) * 0.8 / PI).length() < 1e-6);
    let back = bsdf.eval(&frame(), -Vec3A::Z, Vec3A::new(0.6, 0.0, -0.8));
    assert!((back - Rgb::new(0.2, 0.5, 0.9) * 0.8 / PI).length() < 1e-6, "both sides");
    assert_eq!(bsdf.eval(&frame(), Vec3A::Z, -wi), Rgb::ZERO);
}

#[test]
fn white_diffuse_and_metal_lose_nothing() {
    for r in [0.0, 0.3, 0.7, 1.0] {
        for wo in views() {
            let (diffuse, sigma) = furnace(&Diffuse::new(grey(1.0), r).into(), &frame(), wo, 20_000);
            assert!((diffuse - 1.0).abs() < 5.0 * sigma + 1e-3, "diffuse {r} {wo}: {diffuse}");
            let (metal, sigma) =
                furnace(&Conductor::from_reflectance(grey(1.0), r).into(), &frame(), wo, 20_000);
            assert!((metal - 1.0).abs() < 5.0 * sigma + 6e-3, "metal {r} {wo}: {metal}");
        }
    }
}

#[test]
fn smooth_glass_conserves_radiance_exactly() {
    let glass = Bsdf::from(Dielectric::new(1.5, 0.0, grey(1.0), ScatterMode::Both));
    assert!(glass.is_delta_only());
    for wo in views() {
        let mut rng = Pcg::new(&[3]);
        for _ in 0..200 {
            let s = draw(&glass, &frame(), wo, &mut rng).expect("nothing is absorbed");
            assert!(s.is_delta);
            assert!((s.weight.x * s.eta * s.eta - 1.0).abs() < 1e-5, "{wo}: {}", s.weight.x);
            // Snell's law.
            let sin = |v: Vec3A| (1.0 - v.z * v.z).max(0.0).sqrt();
            let eta = if s.is_transmission { s.eta } else { 1.0 };
            assert!((sin(wo) - eta * sin(s.direction)).abs() < 1e-3, "{wo} {}", s.direction);
        }
    }
}

#[test]
fn a_closed_glass_ball_in_a_furnace_is_invisible() {
    for (ior, roughness) in [(1.5, 0.0), (1.33, 0.0), (0.8, 0.0)] {
        let glass = Bsdf::from(Dielectric::new(ior, roughness, grey(1.0), ScatterMode::Both));
        let mut rng = Pcg::new(&[31]);
        for i in 0..300 {
            let offset = (i as f32 + 0.5) / 300.0;
            let mut p = Vec3A::new(offset, 0.0, (1.0 - offset * offset).sqrt());
            let mut wo = Vec3A::Z;
            let (mut weight, mut is_inside) = (1.0, false);
            for _ in 0..1000 {
                let s = draw(&glass, &ShadingFrame::flat(p), wo, &mut rng).expect("a direction");
                weight *= s.weight.x;
                is_inside ^= s.is_transmission;
                if !is_inside {
                    break;
                }
                p = (p - s.direction * (2.0 * p.dot(s.direction))).normalize();
                wo = -s.direction;
            }
            // Whispering-gallery paths inside of a low index may not leave in time; all others carry exactly 1.
            assert!(is_inside || (weight - 1.0).abs() < 1e-3, "ior {ior}: {weight}");
        }
    }
}

#[test]
fn rough_glass_loses_only_what_bounces_twice() {
    for (r, least) in [(0.1, 0.98), (0.3, 0.96), (0.5, 0.82)] {
        let glass = Bsdf::from(Dielectric::new(1.5, r, grey(1.0), ScatterMode::Both));
        for wo in views().into_iter().filter(|wo| wo.z.abs() > 0.3) {
            let (mean, _) = furnace(&glass, &frame(), wo, 20_000);
            assert!(mean > least && mean < 1.01, "roughness {r} {wo}: {mean}");
        }
    }
}

#[test]
fn index_matched_boundaries_are_not_there() {
    let matched = Bsdf::from(Dielectric::new(1.0, 0.3, Rgb::new(1.0, 0.5, 0.25), ScatterMode::Both));
    assert_eq!(matched.transparency(), Rgb::new(1.0, 0.5, 0.25));
    assert!(matched.is_black());
    let nearly = Bsdf::from(Dielectric::new(1.001, 0.3, grey(1.0), ScatterMode::Both));
    assert!(nearly.is_delta_only() && nearly.transparency() == Rgb::ZERO);
}

#[test]
fn mirrors_reflect() {
    let mirror = Bsdf::from(Conductor::from_reflectance(grey(0.5), 0.0));
    let wo = Vec3A::new(0.6, 0.0, 0.8);
    let s = mirror.sample(&frame(), wo, [0.1, 0.2, 0.3]).expect("a reflection");
    assert!((s.direction - Vec3A::new(-0.6, 0.0, 0.8)).length() < 1e-6 && s.is_delta);
    assert!((s.weight.x - (0.5 + 0.5 * 0.2f32.powi(5))).abs() < 1e-5);
    assert_eq!(mirror.eval(&frame(), wo, s.direction), Rgb::ZERO);
}
