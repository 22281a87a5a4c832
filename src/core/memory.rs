//! Memory that is asked for before it is needed.

/// Whether the machine gives so many bytes at once, as far as it says before they are used.
///
/// What is too large for a plain allocation would end the program.
pub fn gives(bytes: u64) -> bool {
    let mut room = Vec::<u8>::new();
    let given = usize::try_from(bytes).is_ok_and(|bytes| room.try_reserve_exact(bytes).is_ok());
    // An allocation that nobody looks at is left out by the compiler, and counts as given.
    std::hint::black_box(room.as_ptr());
    given
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_little_is_given_and_more_than_addresses_reach_is_not() {
        assert!(gives(0) && gives(1 << 20));
        assert!(!gives(1 << 56) && !gives(u64::MAX));
    }
}
