//! Eight f64 at a time, with operators, for loops that LLVM does not keep in registers by itself.

use crate::base::math::Vec3;
use core::ops::{Add, Div, Mul, Sub};

/// Lanes of a [`Wide`].
pub const WIDTH: usize = 8;

/// Eight f64: operators and functions are IEEE's, lane by lane, with the same bits on every instruction set.
///
/// Values are made by the computation's [`Lanes64`] alone, so that holding one proves that the processor has the
/// instructions.
#[allow(missing_docs)]
pub trait Wide:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Eight yes or no.
    type Mask: Copy;
    fn array(self) -> [f64; WIDTH];
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// `self` where greater, else `other`, also where one is NaN.
    fn max(self, other: Self) -> Self;
    fn gt(self, other: Self) -> Self::Mask;
    /// This in the lanes of `mask`, else `other`.
    fn where_else(self, mask: Self::Mask, other: Self) -> Self;
    /// For normal positive numbers: x = fraction 2^exponent, with the fraction in [1, 2).
    fn fraction(self) -> Self;
    fn exponent(self) -> Self;
    /// Lanes of a mask as bits.
    fn bits(mask: Self::Mask) -> u32;
}

/// Makes [`Wide`]s.
pub trait Lanes64: Copy {
    /// Its eight numbers.
    type F: Wide;
    /// The same number in all lanes.
    fn all(self, x: f64) -> Self::F;
    /// The numbers of an array.
    fn of(self, x: &[f64; WIDTH]) -> Self::F;
}

/// A computation in [`Wide`] lanes; `run` must be `#[inline(always)]`.
pub trait WideTask {
    /// Its result.
    type Out;
    /// Does it.
    fn run<L: Lanes64>(self, lanes: L) -> Self::Out;
}

/// A vector in all lanes.
#[inline(always)]
pub(crate) fn spread<L: Lanes64>(lanes: L, v: Vec3) -> [L::F; 3] {
    [lanes.all(v.x), lanes.all(v.y), lanes.all(v.z)]
}

/// Scalar product of two vectors in every lane, summed from the first component to the last.
#[inline(always)]
pub(crate) fn wide_dot<F: Wide>(a: &[F; 3], b: &[F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// What a positive normal number's bits say besides its fraction.
const FRACTION: u64 = (1 << 52) - 1;

/// Exponent bits of numbers in [1, 2).
const EXPONENT_OF_ONE: u64 = 1023 << 52;
/// 2^52: its fraction's bits hold an integer.
const INTEGER: u64 = 1075 << 52;
/// Offset that is then taken off to give the exponent.
const BIAS: f64 = ((1u64 << 52) + 1023) as f64;

/// Lanes as arrays: any processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrays;

/// Eight f64 in an array.
#[derive(Clone, Copy, Debug)]
pub(super) struct Array([f64; WIDTH]);

/// Lane by lane.
#[inline(always)]
fn each(a: Array, b: Array, f: impl Fn(f64, f64) -> f64) -> Array {
    let mut out = a;
    out.0.iter_mut().zip(b.0).for_each(|(x, y)| *x = f(*x, y));
    out
}

macro_rules! array_operators {
    ($($trait:ident $name:ident $op:tt),*) => { $(
        impl $trait for Array {
            type Output = Array;
            #[inline(always)]
            fn $name(self, other: Array) -> Array {
                each(self, other, |x, y| x $op y)
            }
        }
    )* };
}
array_operators!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Wide for Array {
    type Mask = [bool; WIDTH];
    #[inline(always)]
    fn array(self) -> [f64; WIDTH] {
        self.0
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Array(self.0.map(crate::base::math::sqrt))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Array(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        each(self, other, |x, y| if x > y { x } else { y })
    }
    #[inline(always)]
    fn gt(self, other: Self) -> [bool; WIDTH] {
        let mut mask = [false; WIDTH];
        mask.iter_mut().zip(self.0.iter().zip(other.0)).for_each(|(m, (x, y))| *m = *x > y);
        mask
    }
    #[inline(always)]
    fn where_else(self, mask: [bool; WIDTH], other: Self) -> Self {
        let mut out = other;
        out.0.iter_mut().zip(mask).zip(self.0).for_each(|((o, m), x)| *o = if m { x } else { *o });
        out
    }
    #[inline(always)]
    fn fraction(self) -> Self {
        Array(self.0.map(|x| f64::from_bits(x.to_bits() & FRACTION | EXPONENT_OF_ONE)))
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        Array(self.0.map(|x| f64::from_bits(x.to_bits() >> 52 | INTEGER) - BIAS))
    }
    #[inline(always)]
    fn bits(mask: [bool; WIDTH]) -> u32 {
        (0..).zip(mask).fold(0, |bits, (i, m)| bits | u32::from(m) << i)
    }
}

impl Lanes64 for Arrays {
    type F = Array;
    #[inline(always)]
    fn all(self, x: f64) -> Array {
        Array([x; WIDTH])
    }
    #[inline(always)]
    fn of(self, x: &[f64; WIDTH]) -> Array {
        Array(*x)
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
pub(super) mod avx2 {
    use super::{Add, BIAS, Div, EXPONENT_OF_ONE, FRACTION, INTEGER, Lanes64, Mul, Sub, WIDTH, Wide};
    use core::arch::x86_64::*;

    /// Proof that the processor has AVX2.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx2(());

    impl Avx2 {
        #[target_feature(enable = "avx2")]
        pub fn new() -> Avx2 {
            Avx2(())
        }
    }

    /// Eight f64 in two registers, made by [`Avx2`] alone or from others.
    #[derive(Clone, Copy, Debug)]
    pub struct F8(__m256d, __m256d);

    macro_rules! operators {
        ($($trait:ident $name:ident $op:ident),*) => { $(
            impl $trait for F8 {
                type Output = F8;
                #[inline(always)]
                fn $name(self, other: F8) -> F8 {
                    // SAFETY: the values prove AVX2.
                    unsafe { F8($op(self.0, other.0), $op(self.1, other.1)) }
                }
            }
        )* };
    }
    operators!(Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);

    impl Wide for F8 {
        type Mask = F8;
        #[inline(always)]
        fn array(self) -> [f64; WIDTH] {
            let mut out = [0.0; WIDTH];
            let (low, high) = out.split_at_mut(4);
            // SAFETY: the value proves AVX2; each half holds four numbers, and no alignment is asked.
            unsafe {
                _mm256_storeu_pd(low.as_mut_ptr(), self.0);
                _mm256_storeu_pd(high.as_mut_ptr(), self.1);
            }
            out
        }
        #[inline(always)]
        fn sqrt(self) -> F8 {
            // SAFETY: the value proves AVX2.
            unsafe { F8(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
        }
        #[inline(always)]
        fn abs(self) -> F8 {
            // SAFETY: the value proves AVX2.
            unsafe {
                let sign = _mm256_set1_pd(-0.0);
                F8(_mm256_andnot_pd(sign, self.0), _mm256_andnot_pd(sign, self.1))
            }
        }
        #[inline(always)]
        fn max(self, other: F8) -> F8 {
            // SAFETY: the values prove AVX2.
            unsafe { F8(_mm256_max_pd(self.0, other.0), _mm256_max_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn gt(self, other: F8) -> F8 {
            // SAFETY: the values prove AVX2.
            unsafe {
                F8(_mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0), _mm256_cmp_pd::<_CMP_GT_OQ>(self.1, other.1))
            }
        }
        #[inline(always)]
        fn where_else(self, mask: F8, other: F8) -> F8 {
            // SAFETY: the values prove AVX2.
            unsafe {
                F8(_mm256_blendv_pd(other.0, self.0, mask.0), _mm256_blendv_pd(other.1, self.1, mask.1))
            }
        }
        #[inline(always)]
        fn fraction(self) -> F8 {
            // SAFETY: the value proves AVX2.
            unsafe {
                let fraction = _mm256_castsi256_pd(_mm256_set1_epi64x(FRACTION.cast_signed()));
                let one = _mm256_castsi256_pd(_mm256_set1_epi64x(EXPONENT_OF_ONE.cast_signed()));
                let (low, high) = (_mm256_and_pd(self.0, fraction), _mm256_and_pd(self.1, fraction));
                F8(_mm256_or_pd(low, one), _mm256_or_pd(high, one))
            }
        }
        #[inline(always)]
        fn exponent(self) -> F8 {
            // SAFETY: the value proves AVX2.
            unsafe {
                let (integer, bias) = (_mm256_set1_epi64x(INTEGER.cast_signed()), _mm256_set1_pd(BIAS));
                let low = _mm256_srli_epi64::<52>(_mm256_castpd_si256(self.0));
                let high = _mm256_srli_epi64::<52>(_mm256_castpd_si256(self.1));
                F8(
                    _mm256_sub_pd(_mm256_castsi256_pd(_mm256_or_si256(low, integer)), bias),
                    _mm256_sub_pd(_mm256_castsi256_pd(_mm256_or_si256(high, integer)), bias),
                )
            }
        }
        #[inline(always)]
        fn bits(mask: F8) -> u32 {
            // SAFETY: the value proves AVX2.
            unsafe { (_mm256_movemask_pd(mask.0) | _mm256_movemask_pd(mask.1) << 4).cast_unsigned() }
        }
    }

    impl Lanes64 for Avx2 {
        type F = F8;
        #[inline(always)]
        fn all(self, x: f64) -> F8 {
            // SAFETY: `self` proves AVX2.
            unsafe { F8(_mm256_set1_pd(x), _mm256_set1_pd(x)) }
        }
        #[inline(always)]
        fn of(self, x: &[f64; WIDTH]) -> F8 {
            let (low, high) = x.split_at(4);
            // SAFETY: `self` proves AVX2; each half holds four numbers, and no alignment is asked.
            unsafe { F8(_mm256_loadu_pd(low.as_ptr()), _mm256_loadu_pd(high.as_ptr())) }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
pub(super) mod avx512 {
    use super::{Add, BIAS, Div, EXPONENT_OF_ONE, FRACTION, INTEGER, Lanes64, Mul, Sub, WIDTH, Wide};
    use core::arch::x86_64::*;

    /// Proof that the processor has AVX-512F.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx512(());

    impl Avx512 {
        #[target_feature(enable = "avx512f")]
        pub fn new() -> Avx512 {
            Avx512(())
        }
    }

    /// Eight f64 in a register, made by [`Avx512`] alone or from others.
    #[derive(Clone, Copy, Debug)]
    pub struct F8(__m512d);

    macro_rules! operators {
        ($($trait:ident $name:ident $op:ident),*) => { $(
            impl $trait for F8 {
                type Output = F8;
                #[inline(always)]
                fn $name(self, other: F8) -> F8 {
                    // SAFETY: the values prove AVX-512F.
                    unsafe { F8($op(self.0, other.0)) }
                }
            }
        )* };
    }
    operators!(Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);

    impl Wide for F8 {
        type Mask = __mmask8;
        #[inline(always)]
        fn array(self) -> [f64; WIDTH] {
            let mut out = [0.0; WIDTH];
            // SAFETY: the value proves AVX-512F; the array holds eight numbers, and no alignment is asked.
            unsafe { _mm512_storeu_pd(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn sqrt(self) -> F8 {
            // SAFETY: the value proves AVX-512F.
            unsafe { F8(_mm512_sqrt_pd(self.0)) }
        }
        #[inline(always)]
        fn abs(self) -> F8 {
            // SAFETY: the value proves AVX-512F.
            unsafe { F8(_mm512_abs_pd(self.0)) }
        }
        #[inline(always)]
        fn max(self, other: F8) -> F8 {
            // SAFETY: the values prove AVX-512F.
            unsafe { F8(_mm512_max_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn gt(self, other: F8) -> __mmask8 {
            // SAFETY: the values prove AVX-512F.
            unsafe { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn where_else(self, mask: __mmask8, other: F8) -> F8 {
            // SAFETY: the values prove AVX-512F.
            unsafe { F8(_mm512_mask_blend_pd(mask, other.0, self.0)) }
        }
        #[inline(always)]
        fn fraction(self) -> F8 {
            // SAFETY: the value proves AVX-512F.
            unsafe {
                let (fraction, one) = (FRACTION.cast_signed(), EXPONENT_OF_ONE.cast_signed());
                let bits = _mm512_and_si512(_mm512_castpd_si512(self.0), _mm512_set1_epi64(fraction));
                F8(_mm512_castsi512_pd(_mm512_or_si512(bits, _mm512_set1_epi64(one))))
            }
        }
        #[inline(always)]
        fn exponent(self) -> F8 {
            // SAFETY: the value proves AVX-512F.
            unsafe {
                let integer = _mm512_set1_epi64(INTEGER.cast_signed());
                let bits = _mm512_or_si512(_mm512_srli_epi64::<52>(_mm512_castpd_si512(self.0)), integer);
                F8(_mm512_sub_pd(_mm512_castsi512_pd(bits), _mm512_set1_pd(BIAS)))
            }
        }
        #[inline(always)]
        fn bits(mask: __mmask8) -> u32 {
            mask.into()
        }
    }

    impl Lanes64 for Avx512 {
        type F = F8;
        #[inline(always)]
        fn all(self, x: f64) -> F8 {
            // SAFETY: `self` proves AVX-512F.
            unsafe { F8(_mm512_set1_pd(x)) }
        }
        #[inline(always)]
        fn of(self, x: &[f64; WIDTH]) -> F8 {
            // SAFETY: `self` proves AVX-512F; the array holds eight numbers, and no alignment is asked.
            unsafe { F8(_mm512_loadu_pd(x.as_ptr())) }
        }
    }
}

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
#[allow(unsafe_code)]
pub(super) mod neon {
    use super::{Add, BIAS, Div, EXPONENT_OF_ONE, FRACTION, INTEGER, Lanes64, Mul, Sub, WIDTH, Wide};
    use core::arch::aarch64::*;

    /// Compiled for targets alone whose processors all have NEON.
    #[derive(Clone, Copy, Debug)]
    pub struct Neon;

    /// Eight f64 in four registers.
    #[derive(Clone, Copy, Debug)]
    pub struct F8([float64x2_t; 4]);

    macro_rules! operators {
        ($($trait:ident $name:ident $op:ident),*) => { $(
            impl $trait for F8 {
                type Output = F8;
                #[inline(always)]
                fn $name(self, other: F8) -> F8 {
                    let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
                    // SAFETY: the target has NEON.
                    unsafe { F8([$op(a, e), $op(b, f), $op(c, g), $op(d, h)]) }
                }
            }
        )* };
    }
    operators!(Add add vaddq_f64, Sub sub vsubq_f64, Mul mul vmulq_f64, Div div vdivq_f64);

    impl Wide for F8 {
        type Mask = [uint64x2_t; 4];
        #[inline(always)]
        fn array(self) -> [f64; WIDTH] {
            let mut out = [0.0; WIDTH];
            for (out, x) in out.as_chunks_mut::<2>().0.iter_mut().zip(self.0) {
                // SAFETY: the target has NEON; a pair has as many bytes as the register, and no alignment is asked.
                unsafe { vst1q_f64(out.as_mut_ptr(), x) };
            }
            out
        }
        #[inline(always)]
        fn sqrt(self) -> F8 {
            // SAFETY: the target has NEON.
            F8(self.0.map(|x| unsafe { vsqrtq_f64(x) }))
        }
        #[inline(always)]
        fn abs(self) -> F8 {
            // SAFETY: the target has NEON.
            F8(self.0.map(|x| unsafe { vabsq_f64(x) }))
        }
        #[inline(always)]
        fn max(self, other: F8) -> F8 {
            self.where_else(self.gt(other), other)
        }
        #[inline(always)]
        fn gt(self, other: F8) -> [uint64x2_t; 4] {
            let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
            // SAFETY: the target has NEON.
            unsafe { [vcgtq_f64(a, e), vcgtq_f64(b, f), vcgtq_f64(c, g), vcgtq_f64(d, h)] }
        }
        #[inline(always)]
        fn where_else(self, [i, j, k, l]: [uint64x2_t; 4], other: F8) -> F8 {
            let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
            // SAFETY: the target has NEON.
            unsafe { F8([vbslq_f64(i, a, e), vbslq_f64(j, b, f), vbslq_f64(k, c, g), vbslq_f64(l, d, h)]) }
        }
        #[inline(always)]
        fn fraction(self) -> F8 {
            // SAFETY: the target has NEON.
            F8(self.0.map(|x| unsafe {
                let fraction = vandq_u64(vreinterpretq_u64_f64(x), vdupq_n_u64(FRACTION));
                vreinterpretq_f64_u64(vorrq_u64(fraction, vdupq_n_u64(EXPONENT_OF_ONE)))
            }))
        }
        #[inline(always)]
        fn exponent(self) -> F8 {
            // SAFETY: the target has NEON.
            F8(self.0.map(|x| unsafe {
                let exponent = vshrq_n_u64::<52>(vreinterpretq_u64_f64(x));
                let integer = vreinterpretq_f64_u64(vorrq_u64(exponent, vdupq_n_u64(INTEGER)));
                vsubq_f64(integer, vdupq_n_f64(BIAS))
            }))
        }
        #[inline(always)]
        fn bits([a, b, c, d]: [uint64x2_t; 4]) -> u32 {
            // SAFETY: the target has NEON; the array has as many bytes as the register, and no alignment is asked.
            unsafe {
                let low = vcombine_u32(vmovn_u64(a), vmovn_u64(b));
                let high = vcombine_u32(vmovn_u64(c), vmovn_u64(d));
                let masks = vcombine_u16(vmovn_u32(low), vmovn_u32(high));
                vaddvq_u16(vandq_u16(masks, vld1q_u16(super::super::LANE_BITS.as_ptr()))).into()
            }
        }
    }

    impl Lanes64 for Neon {
        type F = F8;
        #[inline(always)]
        fn all(self, x: f64) -> F8 {
            // SAFETY: the target has NEON.
            F8([unsafe { vdupq_n_f64(x) }; 4])
        }
        #[inline(always)]
        fn of(self, x: &[f64; WIDTH]) -> F8 {
            let [a, b, c, d, e, f, g, h] = *x;
            // SAFETY: the target has NEON; each pair has as many bytes as the register, and no alignment is asked.
            F8([[a, b], [c, d], [e, f], [g, h]].map(|pair| unsafe { vld1q_f64(pair.as_ptr()) }))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::simd::{Isa, run_wide};

    /// Everything that lanes can do, of two arrays.
    struct All([f64; WIDTH], [f64; WIDTH]);

    impl WideTask for All {
        type Out = ([[u64; WIDTH]; 10], u32);

        #[inline(always)]
        fn run<L: Lanes64>(self, lanes: L) -> Self::Out {
            let (a, b) = (lanes.of(&self.0), lanes.of(&self.1));
            let size = b.abs() + lanes.all(1e-300);
            let values = [
                a + b,
                a - b,
                a * b,
                a / b,
                size.sqrt(),
                a.abs(),
                a.max(b),
                a.where_else(a.gt(b), b),
                size.fraction(),
                size.exponent(),
            ];
            let mut bits = [[0; WIDTH]; 10];
            for (bits, value) in bits.iter_mut().zip(values) {
                *bits = value.array().map(f64::to_bits);
            }
            (bits, L::F::bits(a.gt(b)))
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let a = [1.5, -2.25, 3e-310, 0.0, -0.0, 7.0, 1e300, 0.1];
        let b = [0.3, 1e-200, 4.0, 5.0, 2.0, 7.0, -1e300, f64::INFINITY];
        let want = run_wide(Isa::BASELINE, All(a, b));
        assert_eq!(want.1, 0b0100_0001);
        assert_eq!(want.0[7].map(f64::from_bits), [1.5, 1e-200, 4.0, 5.0, 2.0, 7.0, 1e300, f64::INFINITY]);
        assert_eq!((f64::from_bits(want.0[8][2]), f64::from_bits(want.0[9][2])), (1.0, 2.0));
        for isa in Isa::all() {
            assert_eq!(run_wide(isa, All(a, b)), want, "{isa:?}");
        }
    }
}
