//! Choice of the instruction set at run time, without the standard library.
//!
//! The same source is compiled once per instruction set; none contracts `a * b + c`, so all give the same bits.

/// An instruction set for which the hot loops were compiled. Its values come from [`Isa::detect`] and
/// [`Isa::BASELINE`] alone, so that holding one proves that the processor has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Isa(Level);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Isa {
    /// What every processor of the target has.
    pub const BASELINE: Isa = Isa(Level::Baseline);

    /// The widest that this processor and operating system support.
    pub fn detect() -> Isa {
        #[cfg(target_arch = "x86_64")]
        {
            cpufeatures::new!(avx2, "avx2");
            if avx2::get() {
                return Isa(Level::Avx2);
            }
        }
        Isa::BASELINE
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
    if isa.0 == Level::Avx2 {
        #[target_feature(enable = "avx2")]
        fn avx2<T: Task>(task: T) -> T::Out {
            task.run()
        }
        // SAFETY: `Level::Avx2` comes from `Isa::detect` alone, which saw the processor's flag.
        return unsafe { avx2(task) };
    }
    let _ = isa;
    task.run()
}

/// Eight f32 or four f64 at a time, for loops that LLVM does not vectorise well by itself: the same traversal over
/// arrays, whose lanes it splits at the comparisons, runs at 0.7 of the speed.
///
/// A value of the type proves that the processor has the instructions. Every operation is IEEE's, lane by lane;
/// `min` and `max` give `b` where `a` and `b` are equal or one is NaN.
#[allow(missing_docs)]
pub trait Lanes: Copy {
    type F8: Copy;
    type F4: Copy;
    fn splat8(self, x: f32) -> Self::F8;
    fn load8(self, x: &[f32; 8]) -> Self::F8;
    fn store8(self, x: Self::F8) -> [f32; 8];
    fn sub8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn mul8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn min8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    fn max8(self, a: Self::F8, b: Self::F8) -> Self::F8;
    /// Lanes with `a <= b`, as bits.
    fn le8(self, a: Self::F8, b: Self::F8) -> u32;
    fn splat4(self, x: f64) -> Self::F4;
    fn load4(self, x: &[f64; 4]) -> Self::F4;
    fn store4(self, x: Self::F4) -> [f64; 4];
    fn sub4(self, a: Self::F4, b: Self::F4) -> Self::F4;
    fn mul4(self, a: Self::F4, b: Self::F4) -> Self::F4;
    fn min4(self, a: Self::F4, b: Self::F4) -> Self::F4;
    fn max4(self, a: Self::F4, b: Self::F4) -> Self::F4;
    /// Lanes with `a <= b`, as bits.
    fn le4(self, a: Self::F4, b: Self::F4) -> u32;
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
    if isa.0 == Level::Avx2 {
        #[target_feature(enable = "avx2")]
        fn avx2<T: LaneTask>(task: T) -> T::Out {
            task.run(avx2::Avx2::new())
        }
        // SAFETY: `Level::Avx2` comes from `Isa::detect` alone, which saw the processor's flag.
        return unsafe { avx2(task) };
    }
    let _ = isa;
    task.run(Arrays)
}

/// Lanes as arrays: any processor.
#[derive(Clone, Copy, Debug)]
struct Arrays;

macro_rules! arrays {
    ($t:ty, $n:literal, $splat:ident $load:ident $store:ident $sub:ident $mul:ident $min:ident $max:ident $le:ident) => {
        #[inline(always)]
        fn $splat(self, x: $t) -> [$t; $n] {
            [x; $n]
        }
        #[inline(always)]
        fn $load(self, x: &[$t; $n]) -> [$t; $n] {
            *x
        }
        #[inline(always)]
        fn $store(self, x: [$t; $n]) -> [$t; $n] {
            x
        }
        #[inline(always)]
        fn $sub(self, mut a: [$t; $n], b: [$t; $n]) -> [$t; $n] {
            for i in 0..$n {
                a[i] -= b[i];
            }
            a
        }
        #[inline(always)]
        fn $mul(self, mut a: [$t; $n], b: [$t; $n]) -> [$t; $n] {
            for i in 0..$n {
                a[i] *= b[i];
            }
            a
        }
        #[inline(always)]
        fn $min(self, mut a: [$t; $n], b: [$t; $n]) -> [$t; $n] {
            for i in 0..$n {
                a[i] = if a[i] < b[i] { a[i] } else { b[i] };
            }
            a
        }
        #[inline(always)]
        fn $max(self, mut a: [$t; $n], b: [$t; $n]) -> [$t; $n] {
            for i in 0..$n {
                a[i] = if a[i] > b[i] { a[i] } else { b[i] };
            }
            a
        }
        #[inline(always)]
        fn $le(self, a: [$t; $n], b: [$t; $n]) -> u32 {
            let mut mask = 0;
            for i in 0..$n {
                mask |= u32::from(a[i] <= b[i]) << i;
            }
            mask
        }
    };
}

impl Lanes for Arrays {
    type F8 = [f32; 8];
    type F4 = [f64; 4];
    arrays!(f32, 8, splat8 load8 store8 sub8 mul8 min8 max8 le8);
    arrays!(f64, 4, splat4 load4 store4 sub4 mul4 min4 max4 le4);
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
        ($t:ty, $n:literal, $v:ty, $loadu:ident $storeu:ident $set1:ident, $splat:ident $load:ident $store:ident) => {
            #[inline(always)]
            fn $splat(self, x: $t) -> $v {
                // SAFETY: `self` proves AVX2.
                unsafe { $set1(x) }
            }
            #[inline(always)]
            fn $load(self, x: &[$t; $n]) -> $v {
                // SAFETY: `self` proves AVX2; the array has as many bytes as the register, and no alignment is asked.
                unsafe { $loadu(x.as_ptr()) }
            }
            #[inline(always)]
            fn $store(self, x: $v) -> [$t; $n] {
                let mut out = [0.0; $n];
                // SAFETY: as for the load, into an array of our own.
                unsafe { $storeu(out.as_mut_ptr(), x) };
                out
            }
        };
        ($v:ty, $($name:ident = $op:ident),*) => { $(
            #[inline(always)]
            fn $name(self, a: $v, b: $v) -> $v {
                // SAFETY: `self` proves AVX2.
                unsafe { $op(a, b) }
            }
        )* };
    }

    impl super::Lanes for Avx2 {
        type F8 = __m256;
        type F4 = __m256d;
        avx2!(f32, 8, __m256, _mm256_loadu_ps _mm256_storeu_ps _mm256_set1_ps, splat8 load8 store8);
        avx2!(__m256, sub8 = _mm256_sub_ps, mul8 = _mm256_mul_ps, min8 = _mm256_min_ps, max8 = _mm256_max_ps);
        avx2!(f64, 4, __m256d, _mm256_loadu_pd _mm256_storeu_pd _mm256_set1_pd, splat4 load4 store4);
        avx2!(
            __m256d,
            sub4 = _mm256_sub_pd,
            mul4 = _mm256_mul_pd,
            min4 = _mm256_min_pd,
            max4 = _mm256_max_pd
        );
        #[inline(always)]
        fn le8(self, a: __m256, b: __m256) -> u32 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
        }
        #[inline(always)]
        fn le4(self, a: __m256d, b: __m256d) -> u32 {
            // SAFETY: `self` proves AVX2.
            unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a, b)) as u32 }
        }
    }
}
