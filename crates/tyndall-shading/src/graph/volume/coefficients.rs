//! Absorption and scattering together: constants, times one field, times a second one that may hold colours.

use super::terms::{Scale, Term, VolumeCompiler};
use tyndall_math::Rgb;

/// What a field of colours adds to a medium's coefficients. Both fields multiply.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeTint {
    /// The field. Which of it and the density field holds colours is known when their files are.
    pub field: String,
    /// Absorption coefficient where both fields are 1; negative where the colour takes from absorption what it gives to
    /// scattering (an albedo).
    pub sigma_a: Rgb,
    /// Scattering coefficient where both fields are 1.
    pub sigma_s: Rgb,
}

/// Both coefficients of a medium.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coefficients {
    pub(super) sigma_a: Rgb,
    pub(super) sigma_s: Rgb,
    pub(super) density_field: Option<String>,
    pub(super) tint: Option<VolumeTint>,
}

/// One coefficient.
#[derive(Default)]
struct Coefficient {
    /// Without a second field.
    base: [f32; 3],
    /// With it.
    tint: [f32; 3],
    /// Constants and fields are added: no medium has that.
    is_mixed: bool,
    /// The fields are not those of the medium.
    differs: bool,
}

impl Coefficient {
    fn of(terms: &[Term], density: Option<&str>, color: Option<&str>) -> Self {
        let mut sum = Self::default();
        for term in terms {
            let is_tint = color.is_some() && matches!(term.scale, Scale::Product(..));
            let target = if is_tint { &mut sum.tint } else { &mut sum.base };
            *target = std::array::from_fn(|c| target[c] + term.factor[c]);
            sum.differs |= match &term.scale {
                Scale::One => density.is_some(),
                Scale::Field(name) => density != Some(name),
                Scale::Product(a, b) => {
                    color.is_none_or(|color| !is_pair([a, b], [density.unwrap_or(""), color]))
                }
                Scale::Blackbody { .. } => true,
            };
            sum.is_mixed |= matches!(term.scale, Scale::Blackbody { .. });
        }
        let n_constant = terms.iter().filter(|term| term.scale == Scale::One).count();
        sum.is_mixed |= n_constant > 0 && n_constant < terms.len();
        sum
    }
}

fn is_pair(found: [&str; 2], wanted: [&str; 2]) -> bool {
    found == wanted || found == [wanted[1], wanted[0]]
}

/// The field that is in every product, and the other one of them.
fn roles(terms: &[Term]) -> (Option<String>, Option<String>) {
    let products = || {
        terms.iter().filter_map(|term| match &term.scale {
            Scale::Product(a, b) => Some((a, b)),
            _ => None,
        })
    };
    let alone = terms.iter().find_map(|term| match &term.scale {
        Scale::Field(name) => Some(name),
        _ => None,
    });
    let density = alone.or(products().next().map(|(a, _)| a));
    let color = density.and_then(|density| {
        products().find_map(|(a, b)| (a == density).then_some(b).or((b == density).then_some(a)))
    });
    (density.cloned(), color.cloned())
}

impl VolumeCompiler<'_> {
    /// `absorption` and `scattering`.
    pub(super) fn coefficients(&mut self, index: usize) -> Coefficients {
        let scattering = self.non_zero(index, "scattering");
        let absorption = self.non_zero(index, "absorption");
        let all: Vec<Term> = scattering.iter().chain(&absorption).cloned().collect();
        let (density, color) = roles(&all);
        let mut of = |terms: &[Term], name: &str| {
            let found = Coefficient::of(terms, density.as_deref(), color.as_deref());
            self.checked(index, name, found)
        };
        let [base_s, tint_s] = of(&scattering, "scattering");
        let [base_a, tint_a] = of(&absorption, "absorption");
        let sigma_s = self.non_negative(index, "scattering", base_s);
        let sigma_a = self.non_negative(index, "absorption", base_a);
        let tint = color.map(|field| VolumeTint {
            field,
            sigma_a: self.no_less(index, "absorption", tint_a, -sigma_a),
            sigma_s: self.no_less(index, "scattering", tint_s, -sigma_s),
        });
        Coefficients { sigma_a, sigma_s, density_field: density, tint }
    }

    fn non_zero(&mut self, index: usize, name: &str) -> Vec<Term> {
        let mut terms = self.input(index, name);
        terms.0.retain(|term| term.factor != [0.0; 3]);
        terms.0
    }

    /// The factors without and with the second field, after messages.
    fn checked(&mut self, index: usize, name: &str, found: Coefficient) -> [[f32; 3]; 2] {
        let Coefficient { base, tint, is_mixed, differs } = found;
        if is_mixed {
            self.report(index, name, "only products of constants and two fields are supported", "0 was used");
            return [[0.0; 3]; 2];
        }
        if differs {
            let what = "absorption and scattering vary with different fields";
            let action = "one field must scale both: that of scattering, or the only one, was used for both";
            self.report(index, name, what, action);
        }
        [base, tint]
    }

    /// A factor that keeps coefficients from becoming negative for colours up to 1.
    fn no_less(&mut self, index: usize, name: &str, factor: [f32; 3], least: Rgb) -> Rgb {
        let least = least.to_array();
        let clean: [f32; 3] =
            std::array::from_fn(|c| if factor[c].is_finite() { factor[c].max(least[c]) } else { 0.0 });
        if clean != factor {
            let what = format!("{factor:?} times a field is negative or not finite");
            self.report(index, name, &what, "such channels were limited");
        }
        Rgb::from_array(clean)
    }
}
