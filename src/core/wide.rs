//! The widest instructions that the processor has, for loops in plain Rust.
#![allow(unsafe_code, reason = "one call, of a function compiled for instructions that were found before it")]

/// Work that is to be compiled for wide instructions.
pub trait Wide {
    /// What comes of it.
    type Output;

    /// Does it. Only what is inlined, here and below, profits: mark it `#[inline(always)]`, all the way down.
    fn run(self) -> Self::Output;
}

/// Runs `work` as it was compiled for AVX2 and its companions, where the processor has them.
///
/// Every operation gives the same bits as without: multiplications and additions are not fused, and nothing is
/// reordered.
#[inline]
pub fn widely<W: Wide>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
    {
        // SAFETY: the processor has every feature that the function is compiled for, as has just been asked.
        return unsafe { with_avx2(work) };
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn with_avx2<W: Wide>(work: W) -> W::Output {
    work.run()
}
