//! Absurd lights: finite, with a message where something is missing from the picture.

use super::*;

#[test]
fn lights_that_do_not_shine() {
    let none = |light: prim::Light| {
        let (built, messages) = build_with(&light, &images());
        assert!(built.is_none(), "{light:?}");
        messages.len()
    };
    let base = prim(sphere(1.0));
    assert_eq!(none(prim::Light { visible: false, ..base.clone() }), 0);
    assert_eq!(none(prim::Light { intensity: 0.0, ..base.clone() }), 0);
    assert_eq!(none(prim::Light { color: [0.0; 3], ..base.clone() }), 0);
    assert_eq!(none(prim::Light { intensity: -1.0, ..base.clone() }), 1);
    assert_eq!(none(prim::Light { color: [1.0, -0.1, 1.0], ..base.clone() }), 1);
    assert_eq!(none(prim::Light { intensity: f32::NAN, ..base.clone() }), 1);
    assert_eq!(none(prim::Light { exposure: f32::INFINITY, ..base.clone() }), 1);
    for kind in [
        sphere(0.0),
        sphere(-1.0),
        rect(0.0, 1.0),
        LightKind::Disk { radius: 0.0 },
        cylinder(1.0, 0.0),
        LightKind::Sphere { radius: 0.0, as_point: true },
        LightKind::Cylinder { length: 0.0, radius: 1.0, as_line: true },
        LightKind::Distant { angle: f64::NAN },
    ] {
        assert_eq!(none(prim(kind)), 1);
    }
    let mut broken = base.clone();
    broken.world_from_light.matrix3.x_axis.x = f64::NAN;
    assert_eq!(none(broken), 1);
    let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(none(prim::Light { world_from_light: flat, ..base }), 1);
}

#[test]
fn huge_and_tiny_radiance_survives() {
    for (_, base) in lights_with_density() {
        for intensity in [1e20f32, 1e-30] {
            let light = build(&prim::Light { intensity, ..base.clone() });
            let unit = build(&base);
            for from in RECEIVERS {
                let mut rng = Pcg::new(&[9]);
                for _ in 0..50 {
                    let u = Vec2::new(rng.next_f32(), rng.next_f32());
                    let (a, b) = (light.sample(from, u), unit.sample(from, u));
                    let (Some(a), Some(b)) = (a, b) else { continue };
                    assert_eq!(a.pdf, b.pdf);
                    assert!((a.radiance / intensity - b.radiance).length() <= 1e-4 * b.radiance.length());
                }
            }
        }
    }
}

#[test]
fn scale_changes_nothing() {
    for scale in [1e-6, 1e6] {
        for kind in [sphere(0.8), rect(1.2, 0.7), LightKind::Disk { radius: 0.7 }, cylinder(1.5, 0.4)] {
            let unit = build(&prim(kind.clone()));
            let world_from_light = DAffine3::from_scale(DVec3::splat(scale));
            let scaled = build(&prim::Light { world_from_light, ..prim(kind) });
            for from in RECEIVERS {
                let mut rng = Pcg::new(&[4]);
                for _ in 0..50 {
                    let u = Vec2::new(rng.next_f32(), rng.next_f32());
                    let (a, b) = (unit.sample(from, u), scaled.sample(from * scale as f32, u));
                    assert_eq!(a.is_some(), b.is_some());
                    let (Some(a), Some(b)) = (a, b) else { continue };
                    assert!((a.direction - b.direction).length() < 1e-3);
                    assert!((a.pdf / b.pdf - 1.0).abs() < 1e-2, "{} {}", a.pdf, b.pdf);
                }
            }
        }
    }
}

#[test]
fn bodies_are_black_inside_and_behind() {
    let ball = build(&prim(sphere(1.0)));
    assert!(ball.sample(Vec3A::splat(0.1), Vec2::splat(0.4)).is_none());
    assert_eq!(ball.radiance(Vec3A::ZERO, Vec3A::X), Rgb::ZERO);
    assert_eq!(ball.intersect(&Ray::new(Vec3A::ZERO, Vec3A::X)), Some(1.0));
    assert_eq!(ball.intersect(&Ray::new(Vec3A::ZERO, Vec3A::X).up_to(0.5)), None);
    for kind in [rect(1.0, 1.0), LightKind::Disk { radius: 1.0 }] {
        let plane = build(&prim(kind));
        assert!(plane.sample(Vec3A::Z, Vec2::splat(0.4)).is_none());
        assert_eq!(plane.radiance(Vec3A::Z, -Vec3A::Z), Rgb::ZERO);
        assert_eq!(plane.intersect(&Ray::new(Vec3A::Z, -Vec3A::Z)), Some(1.0));
    }
    let tube = build(&prim(cylinder(2.0, 1.0)));
    let through_the_open_end = (Vec3A::new(0.5, 1.0, 0.0) - Vec3A::new(3.0, -1.5, 0.0)).normalize();
    let from = Vec3A::new(3.0, -1.5, 0.0);
    assert!(tube.intersect(&Ray::new(from, through_the_open_end)).is_some());
    assert_eq!(tube.radiance(from, through_the_open_end), Rgb::ZERO);
    assert_eq!(tube.pdf(from, through_the_open_end), 0.0);
}

#[test]
fn damaged_missing_and_odd_images() {
    let dome = prim(LightKind::Dome { texture: Some(DomeTexture { path: PathBuf::from(SKY) }) });
    let px = |v: f32| [v, v, v, 1.0];
    let bad = [px(f32::NAN), px(f32::INFINITY), px(-1.0), px(2.0)];
    let (light, messages) = build_with(&dome, &Images::with(SKY, 2, bad.to_vec()));
    assert_eq!(messages.len(), 1, "{messages:?}");
    let light = light.expect("the good texel shines");
    let mut rng = Pcg::new(&[1]);
    for _ in 0..1000 {
        let s = sample(&light, Vec3A::ZERO, &mut rng).expect("a direction");
        assert!(s.radiance.is_finite() && s.pdf > 0.0 && s.radiance.min_element() >= 0.0);
    }
    let (light, messages) = build_with(&dome, &Images::default());
    assert!(light.is_some() && messages.len() == 1, "the constant dome is left");
    assert!(build_with(&dome, &Images::with(SKY, 2, vec![px(0.0); 4])).0.is_none());
    for width in [1, 65_536] {
        let (light, messages) = build_with(&dome, &Images::with(SKY, width, vec![px(3.0); width]));
        let light = light.expect("a light");
        assert!(messages.is_empty());
        for _ in 0..200 {
            let s = sample(&light, Vec3A::ZERO, &mut rng).expect("a direction");
            assert!((s.pdf * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-2, "{}", s.pdf);
            assert!((s.radiance.x - 3.0).abs() < 1e-5);
        }
    }
}

#[test]
fn a_sun_beside_a_dim_sky_leaves_no_direction_out() {
    let (w, h) = (256, 128);
    let mut pixels = vec![[1e-3, 1e-3, 1e-3, 1.0]; w * h];
    pixels[20 * w + 100] = [1e9, 1e9, 1e9, 1.0];
    let dome = prim(LightKind::Dome { texture: Some(DomeTexture { path: PathBuf::from(SKY) }) });
    let light = build_with(&dome, &Images::with(SKY, w, pixels)).0.expect("a light");
    let least = Cap::sphere();
    let zero = least.integral(|d| f64::from(light.pdf(Vec3A::ZERO, d) <= 0.0));
    assert_eq!(zero, 0.0);
    let total = Cap { frame: Frame::from_normal(Vec3A::Y), height: 2.0 }
        .integral(|d| f64::from(light.pdf(Vec3A::ZERO, d)));
    assert!((total - 1.0).abs() < 0.2, "{total}");
}

#[test]
fn a_receiver_on_the_light_is_no_trouble() {
    for (_, light) in lights_with_density() {
        let light = build(&light);
        let mut rng = Pcg::new(&[2]);
        for from in [Vec3A::ZERO, Vec3A::new(0.2, -0.1, 0.3), Vec3A::X * 0.8, Vec3A::Z * 1e-30] {
            for _ in 0..50 {
                if let Some(s) = sample(&light, from, &mut rng) {
                    assert!(
                        s.radiance.is_finite() && s.pdf.is_finite() && s.pdf > 0.0 && s.direction.is_finite()
                    );
                }
            }
        }
    }
}
