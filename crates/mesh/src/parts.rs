//! Work on many small items, part by part, in parallel and in a fixed order.
//!
//! Welding corners and pairing half-edges are both "bring equal keys together". A sort of all
//! keys does that, but at 15 million keys it is bound by memory. Here items are first dealt into
//! parts that fit a processor's cache (equal keys go to the same part), each part is worked
//! alone, and the answers are put back into the items' order: a radix partition, as in C. Kim et
//! al. (2009), "Sort vs. Hash Revisited", PVLDB 2(2), section 4, with one pass.
//!
//! Within a part items are in ascending order, and answers go back by position, so nothing
//! depends on the number of threads.

use rayon::prelude::*;

/// Items dealt in one go by one thread: its lists stay within the cache of a core.
const CHUNK: usize = 1 << 16;

/// Items that a part should have: with 16 bytes an item, a part is 0.25 MB and sorts within the
/// cache of a core.
const PART: usize = 1 << 14;

/// More parts than this, and dealing itself misses the cache.
const MOST_PARTS: usize = 1 << 10;

/// Returns how many parts suit `n_items`.
pub(crate) fn parts_for(n_items: usize) -> usize {
    n_items.div_ceil(PART).clamp(1, MOST_PARTS)
}

/// What is dealt: the number of an item, or that with a key, so that whoever works a part need not
/// fetch its keys from all over memory.
pub(crate) trait Card: Copy + Default + Send + Sync {
    /// The item's number.
    fn item(self) -> u32;
}

impl Card for u32 {
    fn item(self) -> u32 {
        self
    }
}

/// A key of 96 bits above the number.
impl Card for u128 {
    fn item(self) -> u32 {
        self as u32
    }
}

/// Items `0..n` dealt into parts.
pub(crate) struct Parts<C = u32> {
    chunks: Vec<Chunk<C>>,
    n_parts: usize,
    n_items: usize,
}

/// The items of one chunk, grouped by part, ascending within a part.
struct Chunk<C> {
    cards: Vec<C>,
    /// Where each part's cards begin, and the end.
    starts: Vec<u32>,
}

impl Parts {
    /// Deals items `0..n_items` into parts; `part_of` must return less than `n_parts`.
    pub(crate) fn deal(
        n_items: usize,
        n_parts: usize,
        part_of: impl Fn(u32) -> usize + Sync,
    ) -> Self {
        Self::deal_cards(n_items, n_parts, |item| item, part_of)
    }
}

impl<C: Card> Parts<C> {
    /// Deals the cards of items `0..n_items`; `part_of` must return less than `n_parts`.
    pub(crate) fn deal_cards(
        n_items: usize,
        n_parts: usize,
        card: impl Fn(u32) -> C + Sync,
        part_of: impl Fn(C) -> usize + Sync,
    ) -> Self {
        assert!(u32::try_from(n_items).is_ok(), "items are numbered in 32 bits");
        let chunks = (0..n_items.div_ceil(CHUNK))
            .into_par_iter()
            .map(|i| {
                let range = i * CHUNK..n_items.min((i + 1) * CHUNK);
                let range = range.start as u32..range.end as u32;
                Chunk::deal(range, n_parts, &card, &part_of)
            })
            .collect();
        Self { chunks, n_parts, n_items }
    }

    /// Works every part: `work` gets the part's number and its cards, items ascending.
    pub(crate) fn work<T: Send>(&self, work: impl Fn(usize, Vec<C>) -> T + Sync) -> Vec<T> {
        (0..self.n_parts).into_par_iter().map(|part| work(part, self.cards(part))).collect()
    }

    fn cards(&self, part: usize) -> Vec<C> {
        let mut cards = Vec::new();
        for chunk in &self.chunks {
            cards.extend_from_slice(chunk.part(part));
        }
        cards
    }

    /// Puts the answers of the parts, one an item in the part's order, into the items' order.
    pub(crate) fn gather(&self, answers: &[&[u32]]) -> Vec<u32> {
        let mut read = vec![0; self.n_parts];
        let mut firsts = Vec::with_capacity(self.chunks.len());
        for chunk in &self.chunks {
            firsts.push(read.clone());
            for (part, n) in read.iter_mut().enumerate() {
                *n += chunk.part(part).len();
            }
        }
        let mut gathered = vec![0; self.n_items];
        gathered.par_chunks_mut(CHUNK).zip(&self.chunks).zip(&firsts).enumerate().for_each(
            |(i, ((out, chunk), firsts))| {
                for part in 0..self.n_parts {
                    let answers = &answers[part][firsts[part]..];
                    for (card, &answer) in chunk.part(part).iter().zip(answers) {
                        out[card.item() as usize - i * CHUNK] = answer;
                    }
                }
            },
        );
        gathered
    }
}

impl<C: Card> Chunk<C> {
    fn deal(
        range: std::ops::Range<u32>,
        n_parts: usize,
        card: &(impl Fn(u32) -> C + Sync),
        part_of: &(impl Fn(C) -> usize + Sync),
    ) -> Self {
        let parts: Vec<u16> = range.clone().map(|item| part_of(card(item)) as u16).collect();
        let mut starts = vec![0; n_parts + 1];
        for &part in &parts {
            starts[part as usize + 1] += 1;
        }
        for part in 0..n_parts {
            starts[part + 1] += starts[part];
        }
        let mut next = starts.clone();
        let mut cards = vec![C::default(); parts.len()];
        for (item, &part) in range.zip(&parts) {
            let slot = &mut next[part as usize];
            cards[*slot as usize] = card(item);
            *slot += 1;
        }
        Self { cards, starts }
    }

    fn part(&self, part: usize) -> &[C] {
        &self.cards[self.starts[part] as usize..self.starts[part + 1] as usize]
    }
}

/// Sorts `entries` by bucket and then by value: a counting sort, then a small sort in each bucket.
///
/// Where buckets hold a few entries each, as vertices and edges do, this is three times as fast as
/// a sort of all; where they do not, it is that sort, so no input makes it slow.
pub(crate) fn sorted_by_bucket(
    entries: &[u128],
    n_buckets: usize,
    bucket_of: impl Fn(u128) -> usize,
) -> Vec<u128> {
    let mut starts = vec![0_u32; n_buckets + 1];
    for &entry in entries {
        starts[bucket_of(entry) + 1] += 1;
    }
    for bucket in 0..n_buckets {
        starts[bucket + 1] += starts[bucket];
    }
    let mut next = starts.clone();
    let mut sorted = vec![0; entries.len()];
    for &entry in entries {
        let slot = &mut next[bucket_of(entry)];
        sorted[*slot as usize] = entry;
        *slot += 1;
    }
    for ends in starts.windows(2) {
        let bucket = &mut sorted[ends[0] as usize..ends[1] as usize];
        if bucket.len() > 1 {
            bucket.sort_unstable();
        }
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_back_to_their_items() {
        for n in [0, 1, 5, CHUNK - 1, CHUNK, 3 * CHUNK + 17] {
            let n_parts = 7;
            let parts = Parts::deal(n, n_parts, |item| (item as usize * 31) % n_parts);
            let answers = parts.work(|part, items| {
                assert!(items.is_sorted());
                assert!(items.iter().all(|i| (*i as usize * 31) % n_parts == part));
                items.iter().map(|i| i * 2).collect::<Vec<u32>>()
            });
            let slices: Vec<&[u32]> = answers.iter().map(Vec::as_slice).collect();
            let gathered = parts.gather(&slices);
            assert!(gathered.len() == n && gathered.iter().zip(0..).all(|(a, i)| *a == i * 2));
        }
    }

    #[test]
    fn buckets_come_out_sorted() {
        let entries: Vec<u128> = (0..5000_u128).map(|i| i * 7919 % 5003).collect();
        let sorted = sorted_by_bucket(&entries, 51, |e| (e / 100) as usize);
        assert!(sorted.is_sorted() && sorted.len() == entries.len());
        assert_eq!(sorted_by_bucket(&[], 1, |_| 0), []);
    }

    #[test]
    fn number_of_parts() {
        assert_eq!([0, 1, PART, PART + 1].map(parts_for), [1, 1, 1, 2]);
        assert_eq!(parts_for(usize::MAX / 2), MOST_PARTS);
    }
}
