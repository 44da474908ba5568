//! What merging two lobes costs: a chi-square divergence in closed form.
//!
//! Source: Ruppert et al. 2020, "Robust Fitting of Parallax-Aware Mixtures for Path Guiding", ACM TOG 39(4),
//! doi:10.1145/3386569.3392421, section 5.

use super::vmf::{VmfLobe, concentration_from_mean_cosine, mean_cosine};
use glam::{DVec3, Vec3A};
use std::f64::consts::TAU;

/// The lobe with the weight and the mean vector of both. A uniform lobe stays uniform.
pub(crate) fn merged(a: (f32, VmfLobe), b: (f32, VmfLobe)) -> (f32, VmfLobe) {
    let weight = a.0 + b.0;
    if a.1.kappa() == 0.0 || b.1.kappa() == 0.0 {
        return (weight, VmfLobe::new(Vec3A::Z, 0.0));
    }
    let mean = |(w, lobe): (f32, VmfLobe)| lobe.mean() * (w / weight * mean_cosine(lobe.kappa()));
    let sum = mean(a) + mean(b);
    let lobe = VmfLobe::new(
        sum.try_normalize().unwrap_or(a.1.mean()),
        concentration_from_mean_cosine(sum.length()).max(1e-3),
    );
    (weight, lobe)
}

/// ∫ (π_a v_a + π_b v_b - π_m v_m)² / (π_m v_m) dω, m being the merged lobe.
pub(crate) fn merging_divergence(a: (f32, VmfLobe), b: (f32, VmfLobe)) -> f64 {
    let (weight, lobe) = merged(a, b);
    let [wa, wb, wm] = [a.0, b.0, weight].map(f64::from);
    let squares = wa * wa * quotient_integral(&a.1, &a.1, &lobe)
        + 2.0 * wa * wb * quotient_integral(&a.1, &b.1, &lobe)
        + wb * wb * quotient_integral(&b.1, &b.1, &lobe);
    (squares / wm.max(f64::MIN_POSITIVE) - wm).max(0.0)
}

/// ∫ a b / m dω.
fn quotient_integral(a: &VmfLobe, b: &VmfLobe, m: &VmfLobe) -> f64 {
    let axis = |lobe: &VmfLobe| {
        let mean = lobe.mean();
        DVec3::new(mean.x.into(), mean.y.into(), mean.z.into()) * f64::from(lobe.kappa())
    };
    let length = (axis(a) + axis(b) - axis(m)).length();
    let loss = f64::from(a.kappa()) + f64::from(b.kappa()) - f64::from(m.kappa()) - length;
    let peak = if length < 1e-6 { 0.5 / TAU } else { length / (TAU * -(-2.0 * length).exp_m1()) };
    f64::from(a.peak()) * f64::from(b.peak()) / (f64::from(m.peak()) * peak) * (-loss).exp()
}

#[cfg(test)]
mod tests {
    use super::super::test_support::integrate_sphere;
    use super::*;

    #[test]
    fn the_closed_form_is_the_integral() {
        let lobe = |x: f32, y: f32, kappa: f32| VmfLobe::new(Vec3A::new(x, y, 0.8).normalize(), kappa);
        for (a, b) in [
            ((0.3, lobe(0.1, 0.2, 8.0)), (0.2, lobe(0.4, 0.2, 5.0))),
            ((0.5, lobe(0.0, 0.0, 20.0)), (0.01, lobe(0.3, 0.0, 40.0))),
            ((0.1, VmfLobe::new(Vec3A::Z, 0.0)), (0.05, lobe(0.5, 0.1, 1.0))),
        ] {
            let (wm, m) = merged(a, b);
            let want = integrate_sphere(|d| {
                let p = f64::from(a.0 * a.1.pdf(d) + b.0 * b.1.pdf(d));
                let q = f64::from(wm * m.pdf(d));
                (p - q).powi(2) / q
            });
            let got = merging_divergence(a, b);
            assert!((got - want).abs() < 1e-3 * want + 1e-6, "{got} not {want}");
        }
    }

    #[test]
    fn equal_lobes_merge_for_nothing() {
        for kappa in [0.0, 1e-3, 1.0, 300.0, super::super::MAX_CONCENTRATION] {
            let lobe = VmfLobe::new(Vec3A::X, kappa);
            let cost = merging_divergence((0.2, lobe), (0.3, lobe));
            // κ of a mean cosine in f32 is known to κ · 6e-8 only.
            assert!(cost < 1e-5 + f64::from(kappa) * 1e-6, "κ = {kappa}: {cost}");
        }
    }
}
