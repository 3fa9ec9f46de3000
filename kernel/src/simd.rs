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
