//! Choice of the instruction set at run time, without the standard library.
//!
//! The same source is compiled once per instruction set; none contracts `a * b + c`, so all give the same bits.

mod wide;

pub use wide::{Lanes64, WIDTH, Wide, WideTask};

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
}

impl Isa {
    /// What every processor of the target has.
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
        Isa::BASELINE
    }

    /// Those that this processor has.
    #[cfg(test)]
    pub(crate) fn all() -> impl Iterator<Item = Isa> {
        #[cfg(target_arch = "x86_64")]
        let all = match Isa::detect().0 {
            Level::Baseline => &[Level::Baseline][..],
            Level::Avx2 => &[Level::Baseline, Level::Avx2],
            Level::Avx512 => &[Level::Baseline, Level::Avx2, Level::Avx512],
        };
        #[cfg(not(target_arch = "x86_64"))]
        let all = [Level::Baseline];
        all.iter().map(|level| Isa(*level))
    }
}

/// A computation to be compiled for each instruction set; `run` must be `#[inline(always)]`.
pub trait Task {
    /// What it returns.
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
    /// What it returns.
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
        x.map(|x| crate::math::sqrt(f64::from(x)) as f32)
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
