//! Cubature rules on a square and on a triangle, with fewer points than products of Gauss rules of the same degree.
//!
//! Where no source is named, found by Newton's method on the moment equations of rules that a turn by a quarter (a third)
//! maps onto themselves, to 40 digits. All points lie inside and all weights are positive.
//!
//! Constants of this file are measured by `cargo test -p blik-kernel --lib cubature` (degrees).

/// Points [s, t, weight]: at corner + s u + t v of a parallelogram or triangle with the sides u and v; the weights' sum
/// is 1.
pub(super) type Points = &'static [[f64; 3]];

/// Rules from the smallest on: exact for polynomials of degree 5, 7, 9, 11 and 13.
pub(super) static SQUARE: [Points; CUBATURE_RULES] = [
    &SQUARE_5,
    &turned::<3, 12>(4, None, &SQUARE_7),
    &turned::<4, 17>(4, Some([0.5, 0.5, 0.13168724279835392]), &SQUARE_9),
    &turned::<6, 24>(4, None, &SQUARE_11),
    &turned::<8, 33>(4, Some([0.5, 0.5, 0.0003858287189726264]), &SQUARE_13),
];

/// The same on a triangle.
pub(super) static TRIANGLE: [Points; CUBATURE_RULES] = [
    &turned::<2, 7>(3, Some([THIRD, THIRD, 0.225]), &TRIANGLE_5),
    &turned::<4, 12>(3, None, &TRIANGLE_7),
    &turned::<6, 19>(3, Some([THIRD, THIRD, 0.09713579628279884]), &TRIANGLE_9),
    &turned::<9, 27>(3, None, &TRIANGLE_11),
    &turned::<12, 37>(3, Some([THIRD, THIRD, 0.0525209234008018]), &TRIANGLE_13),
];

/// Number of rules.
pub(super) const CUBATURE_RULES: usize = 5;

/// Points of the largest.
pub(super) const CUBATURE_POINTS_MOST: usize = 37;

/// Weight of a triangle's centre in each barycentric coordinate.
const THIRD: f64 = 1.0 / 3.0;

/// J. Radon, "Zur mechanischen Kubatur", Monatshefte fuer Mathematik 52, 1948.
const SQUARE_5: [[f64; 3]; 7] = {
    const SIDE: f64 = 5.0 / 63.0;
    const CORNER: f64 = 5.0 / 36.0;
    [
        [0.5, 0.5, 2.0 / 7.0],
        [0.5, 0.016954108460352054, SIDE],
        [0.5, 0.9830458915396479, SIDE],
        [0.11270166537925831, 0.2113248654051871, CORNER],
        [0.11270166537925831, 0.7886751345948129, CORNER],
        [0.8872983346207417, 0.2113248654051871, CORNER],
        [0.8872983346207417, 0.7886751345948129, CORNER],
    ]
};

/// Points of degree 7 on the unit square, one of each orbit, and their weights.
const SQUARE_7: [[f64; 3]; 3] = [
    [0.09567862298090131, 0.09835635008431941, 0.05935461688098006],
    [0.685728578820085, 0.30523750067209093, 0.13018629121660932],
    [0.5061675080989845, 0.962941978462164, 0.06045909190241061],
];

/// Points of degree 9 on the unit square, one of each orbit, and their weights.
const SQUARE_9: [[f64; 3]; 4] = [
    [0.12486145001054973, 0.9639808229797848, 0.02802490053239912],
    [0.7266699105678236, 0.7618679101072147, 0.09957060981551752],
    [0.46189583590369143, 0.9263078646668311, 0.0672628344099452],
    [0.8153400598658345, 0.9844249831809888, 0.022219844542549678],
];

/// Points of degree 11 on the unit square, one of each orbit, and their weights.
const SQUARE_11: [[f64; 3]; 6] = [
    [0.08711208204851803, 0.9697431914083684, 0.01651783229113765],
    [0.594293069359321, 0.02323023589923399, 0.02434669433966704],
    [0.1509619477252162, 0.008680388229572263, 0.012005190837680953],
    [0.3421882835423729, 0.09373972584759345, 0.05293408749973715],
    [0.8560009565376682, 0.7626601251822739, 0.056406515432215844],
    [0.2875763755756654, 0.4791709640439888, 0.08778967959956135],
];

/// Points of degree 13 on the unit square, one of each orbit, and their weights.
const SQUARE_13: [[f64; 3]; 8] = [
    [0.9801585238776154, 0.7952688369327067, 0.014429995815020044],
    [0.018046601218163635, 0.9807656324930014, 0.00375856855934021],
    [0.04196010554436905, 0.47481645915180787, 0.029270863722556724],
    [0.010708971525096112, 0.7510946794439033, 0.011476107824650528],
    [0.502820090543092, 0.3113885949131789, 0.06899503583659082],
    [0.2990329961947863, 0.8399677510657162, 0.049996433209237454],
    [0.6732788335655481, 0.8573234193035374, 0.0486845126838102],
    [0.8961454013727678, 0.9207583505746934, 0.02329202516905085],
];

/// Points of degree 5 on the triangle, one of each orbit, and their weights.
const TRIANGLE_5: [[f64; 3]; 2] = [
    [0.4701420641051151, 0.4701420641051151, 0.1323941527885062],
    [0.10128650732345634, 0.10128650732345634, 0.12593918054482714],
];

/// Points of degree 7 on the triangle, one of each orbit, and their weights.
const TRIANGLE_7: [[f64; 3]; 4] = [
    [0.03432430294509715, 0.3047265008681672, 0.057550085569963175],
    [0.8700998678316818, 0.06751786707391609, 0.053034056314872506],
    [0.6232720494910916, 0.3215024938519818, 0.08776281742889211],
    [0.5158423343535917, 0.20644149867001643, 0.13498637401960556],
];

/// Points of degree 9 on the triangle, one of each orbit, and their weights.
const TRIANGLE_9: [[f64; 3]; 6] = [
    [0.2219629891607657, 0.036838412054736286, 0.043283539377289376],
    [0.12582081701412673, 0.43708959149293664, 0.07782754100477428],
    [0.741198598784498, 0.036838412054736286, 0.043283539377289376],
    [0.4896825191987376, 0.020634961602524746, 0.03133470022713907],
    [0.04472951339445271, 0.9105409732110946, 0.02557767565869803],
    [0.18820353561903272, 0.6235929287619345, 0.07964773892721025],
];

/// Points of degree 11 on the triangle, one of each orbit, and their weights.
const TRIANGLE_11: [[f64; 3]; 9] = [
    [0.2907330946081438, 0.44970950826452283, 0.0593968152810648],
    [0.15879800026543345, 0.8168439800143293, 0.02129856985139498],
    [0.5930786420688052, 0.3834459385907766, 0.02815094633675836],
    [0.12940620906489333, 0.15363261679301157, 0.04837620680527245],
    [0.6170021458430917, 0.024076889871401504, 0.02711482784333135],
    [0.8002580322502766, 0.1699250016986716, 0.027354309085103074],
    [0.9345161917851319, 0.033965738586668785, 0.013773802912080302],
    [0.5334180180467722, 0.11554320370737883, 0.05077408544335919],
    [0.12535756170536844, 0.557780949880033, 0.05709376977496883],
];

/// D. A. Dunavant, "High degree efficient symmetrical Gaussian quadrature rules for the triangle", Int. J. Numer. Meth.
/// Eng. 21, 1985, to more digits.
const TRIANGLE_13: [[f64; 3]; 12] = [
    [0.49504818493970465, 0.49504818493970465, 0.011280145209329542],
    [0.4687166351095739, 0.4687166351095739, 0.03142351836245437],
    [0.41452133680127656, 0.41452133680127656, 0.04707250250419427],
    [0.22939957204283135, 0.22939957204283135, 0.04736358653635446],
    [0.11442449519633005, 0.11442449519633005, 0.031167529045793816],
    [0.024811391363458973, 0.024811391363458973, 0.00797577146507437],
    [0.2687949970587609, 0.6363511745616602, 0.03684840272873225],
    [0.6363511745616602, 0.2687949970587609, 0.03684840272873225],
    [0.29173006673428775, 0.6901691599869052, 0.01740146330382212],
    [0.6901691599869052, 0.29173006673428775, 0.01740146330382212],
    [0.12635738549166875, 0.8514095378342412, 0.01552178683904492],
    [0.8514095378342412, 0.12635738549166875, 0.01552178683904492],
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
            assert!(points.len() <= CUBATURE_POINTS_MOST);
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
