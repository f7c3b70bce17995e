//! Memory of large arrays in large pages.
//!
//! What a processor knows about where pages lie reaches over a few MiB of pages of 4 KiB, and each of them costs a fault when it is first written
//! to. Where a map is asked at random places, or a table is filled once, that is a good part of the time. Linux has pages of 2 MiB (on most
//! processors) for programs that ask, and asking helps before memory is written to only. So arrays that are as large as a map are made here;
//! on other systems, and where there are no large pages, they are as any others.

/// From so many bytes on: a page or two, and what does not fill one at either end, are not worth a call to the system.
const LARGE: usize = 4 << 20;

/// Asks the system to keep a new vector in large pages if it has room for 4 MiB or more.
///
/// For vectors that nothing was written to: `Vec::with_capacity(length)`, or `vec![0.0; length]`, which comes as zeros from the system. Memory that
/// never will be written to should not be asked for: it is given out by the large page.
pub fn in_large_pages<T>(vector: Vec<T>) -> Vec<T> {
    let bytes = vector.capacity() * size_of::<T>();
    if bytes >= LARGE {
        advise(vector.as_ptr().cast(), bytes);
    }
    vector
}

/// So many times the same value, in large pages if they are 4 MiB or more.
pub fn filled<T: Clone>(value: T, length: usize) -> Vec<T> {
    let mut vector = in_large_pages(Vec::with_capacity(length));
    vector.resize(length, value);
    vector
}

/// What an iterator gives, in large pages if it is 4 MiB or more.
pub fn collected<T>(values: impl ExactSizeIterator<Item = T>) -> Vec<T> {
    let mut vector = in_large_pages(Vec::with_capacity(values.len()));
    vector.extend(values);
    vector
}

/// Appends to a vector that moves to large pages as it grows.
pub(crate) fn push<T>(vector: &mut Vec<T>, value: T) {
    if vector.len() == vector.capacity() {
        let mut larger = in_large_pages(Vec::with_capacity((2 * vector.len()).max(4)));
        larger.append(vector);
        *vector = larger;
    }
    vector.push(value);
}

/// Asks for large pages under so many bytes from `start` on.
#[cfg(all(target_os = "linux", not(miri)))]
fn advise(start: *const u8, bytes: usize) {
    // SAFETY: asks for a number.
    let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
    let Ok(page @ 1..) = usize::try_from(page) else { return };
    // From the beginning of the page that the array begins in: a mapping that is advised as a whole stays one, and can be moved when it grows.
    let before = start.addr() % page;
    // SAFETY: this advice changes neither what memory holds nor who may use it, whosever it is; and the pages are there, as each holds something
    // of the array. Whether it is heeded does not matter.
    unsafe { libc::madvise(start.wrapping_sub(before).cast_mut().cast(), bytes + before, libc::MADV_HUGEPAGE) };
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise(_: *const u8, _: usize) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_hold_what_was_put_there() {
        for length in [0, 1, LARGE / 4 - 1, LARGE / 4, LARGE / 4 + 1] {
            assert_eq!(filled(7u32, length), vec![7u32; length]);
            assert_eq!(in_large_pages(vec![0u32; length]), vec![0u32; length]);
            assert!(collected(0..length as u32).into_iter().eq(0..length as u32), "{length}");
            let mut grown = Vec::new();
            (0..length as u32).for_each(|i| push(&mut grown, i));
            assert!(grown.iter().copied().eq(0..length as u32), "{length}");
        }
        assert_eq!(filled((), 3), vec![(); 3]);
    }

    /// The flags of the mapping that holds an address.
    #[cfg(target_os = "linux")]
    fn flags(address: usize) -> Option<String> {
        let maps = std::fs::read_to_string("/proc/self/smaps").ok()?;
        let holds = |line: &str| {
            let (from, to) = line.split_whitespace().next()?.split_once('-')?;
            let number = |text| usize::from_str_radix(text, 16).ok();
            Some((number(from)?..number(to)?).contains(&address))
        };
        let mut lines = maps.lines().skip_while(|line| holds(line) != Some(true));
        lines.find_map(|line| line.strip_prefix("VmFlags:")).map(str::to_owned)
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn large_arrays_are_asked_for_in_large_pages() {
        // More than any allocator keeps of what was freed before.
        let length = 48 << 20;
        let asked = in_large_pages(Vec::<u8>::with_capacity(length));
        let plain = Vec::<u8>::with_capacity(length);
        let middle = |vector: &Vec<u8>| flags(vector.as_ptr().addr() + length / 2);
        let enabled = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/enabled").unwrap_or_default();
        match (middle(&asked), middle(&plain)) {
            (Some(asked), Some(plain)) if !enabled.is_empty() && !enabled.contains("[never]") => {
                let marked = |flags: &str| flags.split_whitespace().any(|flag| flag == "hg");
                assert!(marked(&asked), "{asked}");
                assert!(!marked(&plain), "{plain}");
            }
            _ => println!("this system has no large pages, or does not tell: not tested"),
        }
    }
}
