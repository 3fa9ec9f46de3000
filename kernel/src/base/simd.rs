//! Choice of the instruction set without the standard library: at run time on x86-64, by the target on 64-bit ARM.
//!
//! The same source is compiled once per instruction set; none contracts `a * b + c`, so all give the same bits.

mod wide;

pub use wide::{Lanes64, WIDTH, Wide, WideTask};
pub(crate) use wide::{spread, wide_dot};

/// An instruction set for which the hot loops were compiled. Its values come from [`Isa::detect`] and
/// [`Isa::BASELINE`] alone, so that holding one proves that the processor has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Isa(Level);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512F, and AVX2.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    Neon,
}

impl Isa {
    /// Instructions that every processor of the target has.
    pub const BASELINE: Isa = Isa(Level::Baseline);

    /// The widest that this processor and operating system support.
    pub fn detect() -> Isa {
        #[cfg(target_arch = "x86_64")]
        {
            cpufeatures::new!(avx2, "avx2");
            cpufeatures::new!(avx512, "avx512f");
            if avx2::get() && avx512::get() {
                return Isa(Level::Avx512);
            }
            if avx2::get() {
                return Isa(Level::Avx2);
            }
        }
        // no question for the processor: where the target has NEON, all of its processors have
        #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
        return Isa(Level::Neon);
        #[allow(unreachable_code)]
        Isa::BASELINE
    }

    /// Those that this processor has.
    #[cfg(test)]
    pub(crate) fn all() -> impl Iterator<Item = Isa> {
        let all = match Isa::detect().0 {
            Level::Baseline => &[Level::Baseline][..],
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => &[Level::Baseline, Level::Avx2],
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => &[Level::Baseline, Level::Avx2, Level::Avx512],
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Level::Neon => &[Level::Baseline, Level::Neon],
        };
        all.iter().map(|level| Isa(*level))
    }
}

/// Whether the baseline uses NEON as well: beside it arrays serve for comparison alone, and their code is no use where
/// memory is scarce.
#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
const LEAN: bool = cfg!(not(any(test, feature = "std")));

/// One bit for each 16-bit lane of a NEON register: what a mask's lanes are weighed by where they become a number's bits.
#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
const LANE_BITS: [u16; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

/// A computation to be compiled for each instruction set; `run` must be `#[inline(always)]`.
pub trait Task {
    /// Its result.
    type Out;
    /// Does it.
    fn run(self) -> Self::Out;
}

/// Runs `task` compiled for `isa`.
#[inline(always)]
#[allow(unsafe_code)]
pub fn run<T: Task>(isa: Isa, task: T) -> T::Out {
    #[cfg(target_arch = "x86_64")]
    if isa != Isa::BASELINE {
        #[target_feature(enable = "avx2")]
        fn avx2<T: Task>(task: T) -> T::Out {
            task.run()
        }
        // SAFETY: levels other than the baseline come from `Isa::detect` alone, which saw the processor's flag.
        return unsafe { avx2(task) };
    }
    let _ = isa;
    task.run()
}

/// Eight f32 at a time, for loops that LLVM does not vectorise well by itself: the same traversal over
/// arrays, whose lanes it splits at the comparisons, runs at 0.7 of the speed.
///
/// A value of the type proves that the processor has the instructions. Every operation is IEEE's, lane by lane;
/// `min` and `max` give `b` where `a` and `b` are equal or one is NaN.
#[allow(missing_docs)]
pub trait Lanes: Copy {
    type F8: Copy;
    /// One number for all lanes: in a register where registers are wide, else itself.
    type Same: Copy;
    /// Eight yes or no, as all bits or none.
    type M8: Copy;
    fn splat8(self, x: f32) -> Self::F8;
    fn same(self, x: f32) -> Self::Same;
    fn lanes(self, x: Self::Same) -> Self::F8;
    fn load8(self, x: &[f32; 8]) -> Self::F8;
    fn store8(self, x: Self::F8) -> [f32; 8];
    fn sub8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn mul8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn min8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn max8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    /// Lanes with `a <= b`, as bits.
    fn le8(self, a: Self::F8, b: Self::F8) -> u32;
    /// Lanes with `a <= b`.
    fn mask8(self, a: Self::F8, b: Self::F8) -> Self::M8;
    /// `a` in the lanes of `mask`, else `b`.
    fn choose8(self, mask: Self::M8, a: Self::F8, b: Self::F8) -> Self::F8;
    /// Adds `bits` to the lanes of `mask`.
    fn mark8(self, marks: Self::M8, mask: Self::M8, bits: u32) -> Self::M8;
    /// Lanes equal to `x`, as bits.
    fn same8(self, a: &[u32; 8], x: u32) -> u32;
    fn none8(self) -> Self::M8;
    fn marks8(self, marks: Self::M8) -> [u32; 8];
    fn add8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn div8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    /// Square roots, correctly rounded.
    fn root8(self, x: Self::F8) -> Self::F8;
    /// The upper and the lower 16 bits of each, as numbers.
    fn halves8(self, x: &[u32; 8]) -> (Self::F8, Self::F8);
}

/// A computation in explicit lanes; `run` must be `#[inline(always)]`.
pub trait LaneTask {
    /// Its result.
    type Out;
    /// Does it.
    fn run<L: Lanes>(self, lanes: L) -> Self::Out;
}

/// Runs `task` with the lanes of `isa`.
#[inline(always)]
#[allow(unsafe_code)]
pub fn run_lanes<T: LaneTask>(isa: Isa, task: T) -> T::Out {
    #[cfg(target_arch = "x86_64")]
    if isa != Isa::BASELINE {
        #[target_feature(enable = "avx2")]
        fn avx2<T: LaneTask>(task: T) -> T::Out {
            task.run(avx2::Avx2::new())
        }
        // SAFETY: levels other than the baseline come from `Isa::detect` alone, which saw the processor's flag.
        return unsafe { avx2(task) };
    }
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    if isa != Isa::BASELINE || LEAN {
        return task.run(neon::Neon);
    }
    let _ = isa;
    task.run(Arrays)
}

/// Runs `task` with the lanes of `isa`.
#[inline(always)]
#[allow(unsafe_code)]
pub fn run_wide<T: WideTask>(isa: Isa, task: T) -> T::Out {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2<T: WideTask>(task: T) -> T::Out {
            task.run(wide::avx2::Avx2::new())
        }
        #[target_feature(enable = "avx512f")]
        fn avx512<T: WideTask>(task: T) -> T::Out {
            task.run(wide::avx512::Avx512::new())
        }
        match isa.0 {
            Level::Baseline => {}
            // SAFETY: levels other than the baseline come from `Isa::detect` alone, which saw the processor's flags.
            Level::Avx2 => return unsafe { avx2(task) },
            // SAFETY: as above.
            Level::Avx512 => return unsafe { avx512(task) },
        }
    }
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    if isa != Isa::BASELINE || LEAN {
        return task.run(wide::neon::Neon);
    }
    let _ = isa;
    task.run(wide::Arrays)
}

/// Lanes as arrays: any processor.
#[derive(Clone, Copy, Debug)]
struct Arrays;

/// One operation of [`Arrays`], lane by lane.
macro_rules! arrays {
    ($($name:ident($a:ident, $b:ident) = $of:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, mut a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
            for ($a, &$b) in a.iter_mut().zip(&b) {
                *$a = $of;
            }
            a
        }
    )* };
}

impl Lanes for Arrays {
    type F8 = [f32; 8];
    type Same = f32;
    type M8 = [u32; 8];
    arrays! {
        sub8(a, b) = *a - b;
        add8(a, b) = *a + b;
        mul8(a, b) = *a * b;
        div8(a, b) = *a / b;
        min8(a, b) = if *a < b { *a } else { b };
        max8(a, b) = if *a > b { *a } else { b };
    }
    #[inline(always)]
    fn splat8(self, x: f32) -> [f32; 8] {
        [x; 8]
    }
    #[inline(always)]
    fn same(self, x: f32) -> f32 {
        x
    }
    #[inline(always)]
    fn lanes(self, x: f32) -> [f32; 8] {
        [x; 8]
    }
    #[inline(always)]
    fn load8(self, x: &[f32; 8]) -> [f32; 8] {
        *x
    }
    #[inline(always)]
    fn store8(self, x: [f32; 8]) -> [f32; 8] {
        x
    }
    #[inline(always)]
    fn le8(self, a: [f32; 8], b: [f32; 8]) -> u32 {
        let mut mask = 0;
        for i in 0..8 {
            mask |= u32::from(a[i] <= b[i]) << i;
        }
        mask
    }
    #[inline(always)]
    fn mask8(self, a: [f32; 8], b: [f32; 8]) -> [u32; 8] {
        let mut mask = [0; 8];
        for i in 0..8 {
            mask[i] = 0u32.wrapping_sub(u32::from(a[i] <= b[i]));
        }
        mask
    }
    #[inline(always)]
    fn choose8(self, mask: [u32; 8], a: [f32; 8], mut b: [f32; 8]) -> [f32; 8] {
        for i in 0..8 {
            b[i] = if mask[i] != 0 { a[i] } else { b[i] };
        }
        b
    }
    #[inline(always)]
    fn mark8(self, mut marks: [u32; 8], mask: [u32; 8], bits: u32) -> [u32; 8] {
        for i in 0..8 {
            marks[i] |= mask[i] & bits;
        }
        marks
    }
    #[inline(always)]
    fn same8(self, a: &[u32; 8], x: u32) -> u32 {
        (0..).zip(a).fold(0, |mask, (i, &own)| mask | u32::from(own == x) << i)
    }
    #[inline(always)]
    fn none8(self) -> [u32; 8] {
        [0; 8]
    }
    #[inline(always)]
    fn marks8(self, marks: [u32; 8]) -> [u32; 8] {
        marks
    }
    #[inline(always)]
    fn root8(self, x: [f32; 8]) -> [f32; 8] {
        // twice rounded, and right: a root of 24 bits is never that close to the middle of two
        x.map(|x| crate::base::math::sqrt(f64::from(x)) as f32)
    }
    #[inline(always)]
    fn halves8(self, x: &[u32; 8]) -> ([f32; 8], [f32; 8]) {
        (x.map(|x| f32::from((x >> 16) as u16)), x.map(|x| f32::from(x as u16)))
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
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

    macro_rules! avx2 {
        ($($name:ident = $op:ident),*) => { $(
            #[inline(always)]
            fn $name(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: `self` proves AVX2.
                unsafe { $op(a, b) }
            }
        )* };
    }

    impl super::Lanes for Avx2 {
        type F8 = __m256;
        type Same = __m256;
        type M8 = __m256;
        avx2!(sub8 = _mm256_sub_ps, mul8 = _mm256_mul_ps, min8 = _mm256_min_ps, max8 = _mm256_max_ps);
        avx2!(add8 = _mm256_add_ps, div8 = _mm256_div_ps);
        #[inline(always)]
        fn splat8(self, x: f32) -> __m256 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_set1_ps(x) }
        }
        #[inline(always)]
        fn same(self, x: f32) -> __m256 {
            self.splat8(x)
        }
        #[inline(always)]
        fn lanes(self, x: __m256) -> __m256 {
            x
        }
        #[inline(always)]
        fn load8(self, x: &[f32; 8]) -> __m256 {
            // SAFETY: `self` proves AVX2; the array has as many bytes as the register, and no alignment is asked.
            unsafe { _mm256_loadu_ps(x.as_ptr()) }
        }
        #[inline(always)]
        fn store8(self, x: __m256) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: as for the load, into an array of our own.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), x) };
            out
        }
        #[inline(always)]
        fn le8(self, a: __m256, b: __m256) -> u32 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
        }
        #[inline(always)]
        fn mask8(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }
        }
        #[inline(always)]
        fn choose8(self, mask: __m256, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_blendv_ps(b, a, mask) }
        }
        #[inline(always)]
        fn mark8(self, marks: __m256, mask: __m256, bits: u32) -> __m256 {
            // SAFETY: `self` proves AVX2.
            unsafe {
                let bits = _mm256_castsi256_ps(_mm256_set1_epi32(bits.cast_signed()));
                _mm256_or_ps(marks, _mm256_and_ps(mask, bits))
            }
        }
        #[inline(always)]
        fn same8(self, a: &[u32; 8], x: u32) -> u32 {
            // SAFETY: `self` proves AVX2; the array has as many bytes as the register, and no alignment is asked.
            unsafe {
                let a = _mm256_loadu_si256(a.as_ptr().cast());
                let same = _mm256_cmpeq_epi32(a, _mm256_set1_epi32(x.cast_signed()));
                _mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32
            }
        }
        #[inline(always)]
        fn none8(self) -> __m256 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_setzero_ps() }
        }
        #[inline(always)]
        fn marks8(self, marks: __m256) -> [u32; 8] {
            self.store8(marks).map(f32::to_bits)
        }
        #[inline(always)]
        fn root8(self, x: __m256) -> __m256 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_sqrt_ps(x) }
        }
        #[inline(always)]
        fn halves8(self, x: &[u32; 8]) -> (__m256, __m256) {
            // SAFETY: `self` proves AVX2; the array has as many bytes as the register, and no alignment is asked.
            unsafe {
                let x = _mm256_loadu_si256(x.as_ptr().cast());
                let low = _mm256_and_si256(x, _mm256_set1_epi32(0xffff));
                (_mm256_cvtepi32_ps(_mm256_srli_epi32::<16>(x)), _mm256_cvtepi32_ps(low))
            }
        }
    }
}

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
#[allow(unsafe_code)]
mod neon {
    use core::arch::aarch64::*;

    /// Compiled for targets alone whose processors all have NEON.
    #[derive(Clone, Copy, Debug)]
    pub struct Neon;

    /// Eight f32 in two registers.
    #[derive(Clone, Copy, Debug)]
    pub struct F8(float32x4_t, float32x4_t);

    /// Eight masks in two registers.
    #[derive(Clone, Copy, Debug)]
    pub struct M8(uint32x4_t, uint32x4_t);

    impl M8 {
        #[inline(always)]
        fn load(x: &[u32; 8]) -> M8 {
            let (low, high) = x.split_at(4);
            // SAFETY: the target has NEON; each half holds four numbers, and no alignment is asked.
            unsafe { M8(vld1q_u32(low.as_ptr()), vld1q_u32(high.as_ptr())) }
        }

        /// One bit of each.
        #[inline(always)]
        fn bits(self) -> u32 {
            // SAFETY: the target has NEON; the array has as many bytes as the register, and no alignment is asked.
            unsafe {
                let masks = vcombine_u16(vmovn_u32(self.0), vmovn_u32(self.1));
                vaddvq_u16(vandq_u16(masks, vld1q_u16(super::LANE_BITS.as_ptr()))).into()
            }
        }
    }

    macro_rules! neon {
        ($($name:ident = $op:ident),*) => { $(
            #[inline(always)]
            fn $name(self, a: F8, b: F8) -> F8 {
                // SAFETY: the target has NEON.
                unsafe { F8($op(a.0, b.0), $op(a.1, b.1)) }
            }
        )* };
    }

    impl super::Lanes for Neon {
        type F8 = F8;
        type Same = float32x4_t;
        type M8 = M8;
        neon!(sub8 = vsubq_f32, add8 = vaddq_f32, mul8 = vmulq_f32, div8 = vdivq_f32);
        // not `vminq_f32` and `vmaxq_f32`, which give NaN where one is, and the lesser or greater of two zeros
        #[inline(always)]
        fn min8(self, a: F8, b: F8) -> F8 {
            // SAFETY: the target has NEON.
            let less = unsafe { M8(vcltq_f32(a.0, b.0), vcltq_f32(a.1, b.1)) };
            self.choose8(less, a, b)
        }
        #[inline(always)]
        fn max8(self, a: F8, b: F8) -> F8 {
            // SAFETY: the target has NEON.
            let greater = unsafe { M8(vcgtq_f32(a.0, b.0), vcgtq_f32(a.1, b.1)) };
            self.choose8(greater, a, b)
        }
        #[inline(always)]
        fn splat8(self, x: f32) -> F8 {
            self.lanes(self.same(x))
        }
        #[inline(always)]
        fn same(self, x: f32) -> float32x4_t {
            // SAFETY: the target has NEON.
            unsafe { vdupq_n_f32(x) }
        }
        #[inline(always)]
        fn lanes(self, x: float32x4_t) -> F8 {
            F8(x, x)
        }
        #[inline(always)]
        fn load8(self, x: &[f32; 8]) -> F8 {
            let (low, high) = x.split_at(4);
            // SAFETY: the target has NEON; each half holds four numbers, and no alignment is asked.
            unsafe { F8(vld1q_f32(low.as_ptr()), vld1q_f32(high.as_ptr())) }
        }
        #[inline(always)]
        fn store8(self, x: F8) -> [f32; 8] {
            let mut out = [0.0; 8];
            let (low, high) = out.split_at_mut(4);
            // SAFETY: as for the load, into an array of our own.
            unsafe {
                vst1q_f32(low.as_mut_ptr(), x.0);
                vst1q_f32(high.as_mut_ptr(), x.1);
            }
            out
        }
        #[inline(always)]
        fn le8(self, a: F8, b: F8) -> u32 {
            self.mask8(a, b).bits()
        }
        #[inline(always)]
        fn mask8(self, a: F8, b: F8) -> M8 {
            // SAFETY: the target has NEON.
            unsafe { M8(vcleq_f32(a.0, b.0), vcleq_f32(a.1, b.1)) }
        }
        #[inline(always)]
        fn choose8(self, mask: M8, a: F8, b: F8) -> F8 {
            // SAFETY: the target has NEON.
            unsafe { F8(vbslq_f32(mask.0, a.0, b.0), vbslq_f32(mask.1, a.1, b.1)) }
        }
        #[inline(always)]
        fn mark8(self, marks: M8, mask: M8, bits: u32) -> M8 {
            // SAFETY: the target has NEON.
            unsafe {
                let bits = vdupq_n_u32(bits);
                M8(vorrq_u32(marks.0, vandq_u32(mask.0, bits)), vorrq_u32(marks.1, vandq_u32(mask.1, bits)))
            }
        }
        #[inline(always)]
        fn same8(self, a: &[u32; 8], x: u32) -> u32 {
            let a = M8::load(a);
            // SAFETY: the target has NEON.
            let same = unsafe {
                let x = vdupq_n_u32(x);
                M8(vceqq_u32(a.0, x), vceqq_u32(a.1, x))
            };
            same.bits()
        }
        #[inline(always)]
        fn none8(self) -> M8 {
            // SAFETY: the target has NEON.
            unsafe { M8(vdupq_n_u32(0), vdupq_n_u32(0)) }
        }
        #[inline(always)]
        fn marks8(self, marks: M8) -> [u32; 8] {
            // SAFETY: the target has NEON.
            let numbers = unsafe { F8(vreinterpretq_f32_u32(marks.0), vreinterpretq_f32_u32(marks.1)) };
            self.store8(numbers).map(f32::to_bits)
        }
        #[inline(always)]
        fn root8(self, x: F8) -> F8 {
            // SAFETY: the target has NEON.
            unsafe { F8(vsqrtq_f32(x.0), vsqrtq_f32(x.1)) }
        }
        #[inline(always)]
        fn halves8(self, x: &[u32; 8]) -> (F8, F8) {
            let x = M8::load(x);
            // SAFETY: the target has NEON.
            unsafe {
                let (upper, lower) = ((vshrq_n_u32::<16>(x.0), vshrq_n_u32::<16>(x.1)), vdupq_n_u32(0xffff));
                let lower = (vandq_u32(x.0, lower), vandq_u32(x.1, lower));
                (
                    F8(vcvtq_f32_u32(upper.0), vcvtq_f32_u32(upper.1)),
                    F8(vcvtq_f32_u32(lower.0), vcvtq_f32_u32(lower.1)),
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything that lanes can do, of two arrays of numbers and one of bits.
    struct All([f32; 8], [f32; 8], [u32; 8]);

    impl LaneTask for All {
        type Out = ([[u32; 8]; 14], [u32; 2]);

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> Self::Out {
            let (a, b) = (lanes.load8(&self.0), lanes.load8(&self.1));
            let mask = lanes.mask8(a, b);
            let size = lanes.max8(b, lanes.splat8(1e-40));
            let (upper, lower) = lanes.halves8(&self.2);
            let values = [
                lanes.add8(a, lanes.splat8(0.3)),
                lanes.sub8(a, lanes.lanes(lanes.same(0.1))),
                lanes.mul8(a, lanes.splat8(0.7)),
                lanes.div8(lanes.splat8(1e-3), b),
                lanes.min8(a, b),
                lanes.min8(b, a),
                lanes.max8(a, b),
                lanes.max8(b, a),
                lanes.choose8(mask, a, b),
                lanes.root8(size),
                upper,
                lower,
            ];
            let mut bits = [[0; 8]; 14];
            for (bits, value) in bits.iter_mut().zip(values) {
                *bits = lanes.store8(value).map(f32::to_bits);
            }
            bits[12] = lanes.marks8(lanes.none8());
            bits[13] = lanes.marks8(lanes.mark8(lanes.mark8(lanes.none8(), mask, 5), mask, 0x8000_0002));
            (bits, [lanes.le8(a, b), lanes.same8(&self.2, 0x0003_ffff)])
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (nan, infinity) = (f32::NAN, f32::INFINITY);
        let a = [1.5, 0.0, -0.0, nan, 2.0, 3e-41, -infinity, nan];
        let b = [-0.3, -0.0, 0.0, 4.0, nan, 7.0, 5e-39, -nan];
        let halves = [0x0003_ffff, 0, u32::MAX, 0x8000_0001, 0x0003_ffff, 1, 0x1_0000, 0x0003_fffe];
        let want = run_lanes(Isa::BASELINE, All(a, b, halves));
        // the second where equal and where one is no number
        assert_eq!(want.0[4], [-0.3, -0.0, 0.0, 4.0, nan, 3e-41, -infinity, -nan].map(f32::to_bits));
        assert_eq!(want.0[7], [1.5, 0.0, -0.0, nan, 2.0, 7.0, 5e-39, nan].map(f32::to_bits));
        assert_eq!(want.0[11].map(f32::from_bits), [65535.0, 0.0, 65535.0, 1.0, 65535.0, 1.0, 0.0, 65534.0]);
        assert_eq!(want.0[13], [0, 1, 1, 0, 0, 1, 1, 0].map(|met| met * 0x8000_0007));
        assert_eq!(want.1, [0b0110_0110, 0b0001_0001]);
        for isa in Isa::all() {
            assert_eq!(run_lanes(isa, All(a, b, halves)), want, "{isa:?}");
        }
    }
}
