//! Numbered pieces of work, block by block, so that a long study can tell how far it has come.

use rayon::prelude::*;

/// Number of pieces in a block.
const BLOCK: usize = 10;

/// The results of one block.
#[derive(Debug, PartialEq)]
pub(crate) struct FinishedBlock<T> {
    /// Number of pieces of this and all earlier blocks.
    pub(crate) done: u64,
    /// The results, in the order of their numbers, without those that have none.
    pub(crate) found: Vec<T>,
}

/// Computes the pieces with the numbers below `count` on all cores.
pub(crate) fn in_blocks<T: Send, E: Send>(
    count: u64,
    compute: impl Fn(u64) -> Result<Option<T>, E> + Sync,
) -> impl Iterator<Item = Result<FinishedBlock<T>, E>> {
    (0..count).step_by(BLOCK).map(move |first| {
        let done = count.min(first + BLOCK as u64);
        let found: Result<Vec<T>, E> =
            (first..done).into_par_iter().map(&compute).filter_map(Result::transpose).collect();
        Ok(FinishedBlock { done, found: found? })
    })
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn every_piece_is_done_once_and_in_order() {
        let odd = |number: u64| Ok::<_, Infallible>((number % 2 == 1).then_some(number));
        let blocks: Result<Vec<_>, _> = in_blocks(25, odd).collect();
        let expected = [(10, 0..10), (20, 10..20), (25, 20..25)].map(|(done, range)| {
            FinishedBlock { done, found: range.filter(|n| n % 2 == 1).collect() }
        });
        assert_eq!(blocks.unwrap(), expected);
    }

    #[test]
    fn an_error_ends_its_block() {
        let fail = |number: u64| if number == 12 { Err("no bone") } else { Ok(Some(number)) };
        let ends: Vec<_> = in_blocks(20, fail).map(|block| block.map(|block| block.done)).collect();
        assert_eq!(ends, [Ok(10), Err("no bone")]);
    }
}
