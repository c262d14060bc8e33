//! Memory that is used again and again, but not more of it than is of use.
//!
//! What a refresh needs besides the picture is most while nothing is known of it, or after a cut: as many numbers as there are pixels, where a
//! hundredth of that is enough later on.

/// Less is not worth giving back.
const FEW: usize = 1024;

/// Gives memory back if less than half of it is in use, and keeps a quarter more than is.
pub(crate) fn give_back<T>(memory: &mut Vec<T>) {
    let used = memory.len();
    give_back_but(memory, used);
}

/// The same of memory that is empty now, and of which `used` has been of use.
pub(crate) fn give_back_but<T>(memory: &mut Vec<T>, used: usize) {
    let used = used.max(FEW);
    if memory.capacity() / 2 > used {
        memory.shrink_to(used + used / 4);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_used_once_is_not_kept_for_ever() {
        let mut memory: Vec<u32> = (0..1_000_000).collect();
        give_back(&mut memory);
        assert!(memory.capacity() >= 1_000_000);
        memory.truncate(10_000);
        give_back(&mut memory);
        assert!((10_000..20_000).contains(&memory.capacity()) && memory[9_999] == 9_999);
    }
}
