//! Cubature rules on a square and on a triangle, with fewer points than products of Gauss rules of the same degree.
//!
//! Where no source is named, found by Newton's method on the moment equations of rules that a turn by a quarter (a third)
//! maps onto themselves, to 40 digits. All points lie inside and all weights are positive.

/// Points [s, t, weight]: at corner + s u + t v of a parallelogram or triangle with the sides u and v; the weights' sum
/// is 1.
pub(super) type Points = &'static [[f64; 3]];

/// Rules from the smallest on: exact for polynomials of degree 5, 7, 9, 11 and 13.
pub(super) static SQUARE: [Points; RULES] = [
    &SQUARE_5,
    &turned::<3, 12>(4, None, &SQUARE_7),
    &turned::<4, 17>(4, Some([0.5, 0.5, 0.131687242798353909]), &SQUARE_9),
    &turned::<6, 24>(4, None, &SQUARE_11),
    &turned::<8, 33>(4, Some([0.5, 0.5, 0.000385828718972626395]), &SQUARE_13),
];

/// The same on a triangle.
pub(super) static TRIANGLE: [Points; RULES] = [
    &turned::<2, 7>(3, Some([THIRD, THIRD, 0.225]), &TRIANGLE_5),
    &turned::<4, 12>(3, None, &TRIANGLE_7),
    &turned::<6, 19>(3, Some([THIRD, THIRD, 0.0971357962827988338]), &TRIANGLE_9),
    &turned::<9, 27>(3, None, &TRIANGLE_11),
    &turned::<12, 37>(3, Some([THIRD, THIRD, 0.0525209234008017994]), &TRIANGLE_13),
];

/// Number of rules.
pub(super) const RULES: usize = 5;

/// Points of the largest.
pub(super) const LARGEST: usize = 37;

const THIRD: f64 = 1.0 / 3.0;

/// J. Radon, "Zur mechanischen Kubatur", Monatshefte fuer Mathematik 52, 1948.
const SQUARE_5: [[f64; 3]; 7] = {
    const SIDE: f64 = 5.0 / 63.0;
    const CORNER: f64 = 5.0 / 36.0;
    [
        [0.5, 0.5, 2.0 / 7.0],
        [0.5, 0.0169541084603520524, SIDE],
        [0.5, 0.983045891539647948, SIDE],
        [0.112701665379258311, 0.211324865405187118, CORNER],
        [0.112701665379258311, 0.788675134594812882, CORNER],
        [0.887298334620741689, 0.211324865405187118, CORNER],
        [0.887298334620741689, 0.788675134594812882, CORNER],
    ]
};

const SQUARE_7: [[f64; 3]; 3] = [
    [0.0956786229809013133, 0.0983563500843194045, 0.059354616880980057],
    [0.685728578820085031, 0.305237500672090907, 0.130186291216609332],
    [0.506167508098984444, 0.962941978462163996, 0.0604590919024106114],
];

const SQUARE_9: [[f64; 3]; 4] = [
    [0.124861450010549733, 0.963980822979784834, 0.0280249005323991213],
    [0.726669910567823595, 0.761867910107214668, 0.0995706098155175238],
    [0.461895835903691413, 0.926307864666831154, 0.0672628344099452008],
    [0.815340059865834427, 0.98442498318098886, 0.0222198445425496767],
];

const SQUARE_11: [[f64; 3]; 6] = [
    [0.0871120820485180313, 0.969743191408368454, 0.0165178322911376489],
    [0.594293069359320977, 0.0232302358992339921, 0.024346694339667041],
    [0.150961947725216218, 0.00868038822957226352, 0.0120051908376809536],
    [0.342188283542372902, 0.0937397258475934498, 0.0529340874997371501],
    [0.856000956537668153, 0.762660125182273881, 0.0564065154322158469],
    [0.287576375575665375, 0.479170964043988816, 0.0877896795995613594],
];

const SQUARE_13: [[f64; 3]; 8] = [
    [0.980158523877615367, 0.795268836932706629, 0.014429995815020043],
    [0.0180466012181636345, 0.980765632493001441, 0.00375856855934020977],
    [0.0419601055443690452, 0.474816459151807865, 0.0292708637225567255],
    [0.0107089715250961116, 0.751094679443903243, 0.0114761078246505277],
    [0.502820090543091956, 0.311388594913178873, 0.0689950358365908275],
    [0.2990329961947863, 0.839967751065716204, 0.0499964332092374547],
    [0.673278833565548075, 0.857323419303537395, 0.0486845126838102047],
    [0.896145401372767794, 0.920758350574693388, 0.0232920251690508505],
];

const TRIANGLE_5: [[f64; 3]; 2] = [
    [0.47014206410511509, 0.47014206410511509, 0.132394152788506181],
    [0.101286507323456339, 0.101286507323456339, 0.125939180544827153],
];

const TRIANGLE_7: [[f64; 3]; 4] = [
    [0.0343243029450971465, 0.304726500868167196, 0.0575500855699631715],
    [0.870099867831681796, 0.0675178670739160854, 0.0530340563148725029],
    [0.623272049491091566, 0.321502493851981823, 0.0877628174288921101],
    [0.515842334353591779, 0.206441498670016438, 0.134986374019605549],
];

const TRIANGLE_9: [[f64; 3]; 6] = [
    [0.221962989160765696, 0.0368384120547362836, 0.0432835393772893773],
    [0.125820817014126725, 0.437089591492936637, 0.0778275410047742793],
    [0.741198598784498021, 0.0368384120547362836, 0.0432835393772893773],
    [0.489682519198737628, 0.0206349616025247444, 0.0313347002271390705],
    [0.0447295133944527099, 0.91054097321109458, 0.0255776756586980313],
    [0.18820353561903273, 0.62359292876193454, 0.079647738927210253],
];

const TRIANGLE_11: [[f64; 3]; 9] = [
    [0.290733094608143774, 0.449709508264522855, 0.0593968152810648],
    [0.15879800026543346, 0.816843980014329333, 0.0212985698513949782],
    [0.593078642068805282, 0.383445938590776556, 0.0281509463367583607],
    [0.129406209064893341, 0.153632616793011573, 0.0483762068052724494],
    [0.617002145843091664, 0.0240768898714015029, 0.0271148278433313491],
    [0.800258032250276546, 0.169925001698671609, 0.0273543090851030734],
    [0.934516191785131913, 0.0339657385866687844, 0.0137738029120803022],
    [0.533418018046772229, 0.115543203707378831, 0.0507740854433591938],
    [0.125357561705368425, 0.557780949880033061, 0.0570937697749688265],
];

/// D. A. Dunavant, "High degree efficient symmetrical Gaussian quadrature rules for the triangle", Int. J. Numer. Meth.
/// Eng. 21, 1985, to more digits.
const TRIANGLE_13: [[f64; 3]; 12] = [
    [0.495048184939704651, 0.495048184939704652, 0.0112801452093295422],
    [0.468716635109573881, 0.468716635109573881, 0.0314235183624543697],
    [0.414521336801276583, 0.414521336801276582, 0.0470725025041942708],
    [0.229399572042831357, 0.229399572042831357, 0.0473635865363544608],
    [0.114424495196330055, 0.114424495196330055, 0.0311675290457938146],
    [0.0248113913634589747, 0.0248113913634589746, 0.00797577146507436882],
    [0.268794997058760904, 0.636351174561660279, 0.0368484027287322473],
    [0.63635117456166028, 0.268794997058760903, 0.0368484027287322474],
    [0.291730066734287762, 0.690169159986905241, 0.0174014633038221204],
    [0.690169159986905241, 0.291730066734287762, 0.0174014633038221204],
    [0.126357385491668739, 0.851409537834241173, 0.0155217868390449188],
    [0.851409537834241173, 0.126357385491668739, 0.0155217868390449189],
];

/// All points of a rule: its centre, where it has one, and one point of each orbit turned `order` times: by quarters on
/// the square, by thirds on the triangle (its barycentric coordinates take each other's places).
const fn turned<const ORBITS: usize, const POINTS: usize>(
    order: usize,
    centre: Option<[f64; 3]>,
    orbits: &[[f64; 3]; ORBITS],
) -> [[f64; 3]; POINTS] {
    let mut points = [[0.0; 3]; POINTS];
    let mut next = 0;
    if let Some(centre) = centre {
        points[0] = centre;
        next = 1;
    }
    assert!(next + order * ORBITS == POINTS, "all orbits and no more");
    let mut orbit = 0;
    while orbit < ORBITS {
        let [mut s, mut t, weight] = orbits[orbit];
        let mut turn = 0;
        while turn < order {
            points[next] = [s, t, weight];
            next += 1;
            (s, t) = if order == 4 { (1.0 - t, s) } else { (1.0 - s - t, s) };
            turn += 1;
        }
        orbit += 1;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1e-15: nodes and weights are rounded once or twice, numbers of at most 1 each.
    #[test]
    fn rules_integrate_polynomials_of_their_degree() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let check = |points: Points, degree: i32, mean: &dyn Fn(i32, i32) -> f64| {
            assert!(points.len() <= LARGEST);
            for p in 0..=degree {
                for q in 0..=degree - p {
                    let sum: f64 = points.iter().map(|[s, t, w]| w * s.powi(p) * t.powi(q)).sum();
                    assert!((sum - mean(p, q)).abs() < 1e-15, "{} points, {p} {q}: {sum}", points.len());
                }
            }
        };
        for (points, degree) in SQUARE.into_iter().zip([5, 7, 9, 11, 13]) {
            check(points, degree, &|p, q| 1.0 / (f64::from(p + 1) * f64::from(q + 1)));
        }
        for (points, degree) in TRIANGLE.into_iter().zip([5, 7, 9, 11, 13]) {
            check(points, degree, &|p, q| 2.0 * factorial(p) * factorial(q) / factorial(p + q + 2));
        }
        let inside = |p: &[f64; 3]| p.iter().all(|x| *x > 0.0 && *x < 1.0);
        assert!(SQUARE.iter().chain(&TRIANGLE).all(|rule| rule.iter().all(inside)));
        assert!(TRIANGLE.iter().all(|rule| rule.iter().all(|[s, t, _]| s + t < 1.0)));
    }
}
