//! The two queues: what is split and what is merged next, and when they agree.

use super::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How far beyond the last frame's border priorities enter the queues at first.
const BAND: f32 = 1.004;

/// Order of splitting in one number: from the highest bit the priority (bits of a number that is not negative sort like it), 32; how coarse it is, 6; its
/// name, 31 a coordinate; the record, 28.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key(u128);

impl Key {
    pub fn new(priority: f32, diamond: Diamond, record: u32) -> Key {
        let [x, y] = diamond.at.map(u128::from);
        let coarse = u128::from(63 - diamond.level());
        Key(u128::from(priority.to_bits()) << 96 | coarse << 90 | x << 59 | y << 28 | u128::from(record))
    }

    /// The key in the order of merging: what is split last is merged first.
    pub fn reversed(self) -> Key {
        Key(!self.0)
    }

    pub fn at(self) -> Point {
        [(self.0 >> 59) as u32 & 0x7fff_ffff, (self.0 >> 28) as u32 & 0x7fff_ffff]
    }

    pub fn record(self) -> u32 {
        self.0 as u32 & 0xfff_ffff
    }

    pub fn number(self) -> f32 {
        f32::from_bits((self.0 >> 96) as u32)
    }
}

/// How many are sorted at once.
const SOON: usize = 256;

/// Greatest first. Most of what a frame changes is known when it begins: it is sorted a few at a time, since a stopped frame may not live to see the
/// rest, and what is sorted can be seen coming. What becomes known later is in a heap.
#[derive(Clone, Debug, Default)]
pub(super) struct Queue {
    /// In rising order; empty only if `rest` is.
    sorted: Vec<Key>,
    /// None of it is greater than any that is sorted …
    rest: Vec<Key>,
    /// … and none before one of these places than any behind it.
    parts: Vec<usize>,
    later: BinaryHeap<Key>,
}

impl Queue {
    pub fn clear(&mut self) {
        self.sorted.clear();
        self.rest.clear();
        self.parts.clear();
        self.later.clear();
    }

    pub fn push(&mut self, key: Key) {
        self.later.push(key);
    }

    /// Adds many.
    fn extend(&mut self, keys: impl Iterator<Item = Key>) {
        self.rest.append(&mut self.sorted);
        self.rest.extend(keys);
        self.parts.clear();
        self.refill();
    }

    /// Sorts the next few, below what is sorted.
    fn refill(&mut self) {
        // By halves, which are there for the next time.
        let mut from = self.parts.last().copied().unwrap_or(0);
        while self.rest.len() - from > SOON {
            let half = (self.rest.len() - from) / 2;
            self.rest[from..].select_nth_unstable(half);
            from += half;
            self.parts.push(from);
        }
        self.parts.pop();
        self.rest[from..].sort_unstable();
        self.sorted.splice(0..0, self.rest.drain(from..));
    }

    fn peek(&self) -> Option<Key> {
        self.sorted.last().copied().max(self.later.peek().copied())
    }

    fn pop(&mut self) {
        if self.later.peek() > self.sorted.last() {
            self.later.pop();
            return;
        }
        self.sorted.pop();
        if self.sorted.len() <= AHEAD[0] && !self.rest.is_empty() {
            self.refill();
        }
    }

    /// The last of the next few hundred, if there are more.
    fn urgent(&self) -> Option<Key> {
        self.rest[self.parts.last().copied()?..].iter().min().copied()
    }

    /// What comes `steps` after the next, as far as that is known.
    fn coming(&self, steps: usize) -> Option<Key> {
        self.sorted.len().checked_sub(1 + steps).map(|at| self.sorted[at])
    }
}

impl<G: Ground> RoamFlight<'_, G> {
    /// From scratch: what is to be split is searched for without a record of anything, then split without a queue.
    pub(super) fn descend(&mut self) {
        let Some(lens) = &self.lens else { return };
        let budget = self.budget();
        let finest = self.finest();
        let found = self.bounds.search(&mut self.search, lens, finest, self.tolerance, budget);
        // What cannot be searched for is found by splitting it.
        let Some((bits, level, name)) = found else { return };
        self.border = f32::from_bits(bits);
        self.ready.clear();
        // Nothing is ready twice, and what becomes ready is pushed: the last first, while its memory is near.
        self.ready.push(0);
        while let Some(record) = self.ready.pop() {
            let known = &self.records[record as usize];
            let diamond = Diamond::at(known.at);
            let order = (self.list.priority(known.place).to_bits(), Reverse(diamond.level()), diamond.name());
            if known.list == SPLIT && order >= (bits, level, name) {
                self.split(record);
            }
        }
    }

    /// Whether a key is still true.
    fn valid(&self, key: Key, list: u8) -> bool {
        let known = &self.records[key.record() as usize];
        known.list == list && known.at == key.at() && self.list.priority(known.place) == key.number()
    }

    /// Makes the band wider and takes what it holds into the queues.
    fn widen(&mut self, low: f32, high: f32) {
        let (low, high) = (low.min(self.band.0), high.max(self.band.1));
        let within = [Between::new(low.max(self.tolerance), self.band.0), Between::new(self.band.1, high)];
        self.list.find(within, [&mut self.found, &mut self.found_merges]);
        self.enter(low, high);
    }

    /// Takes what was found in a band into the queues.
    pub(super) fn enter(&mut self, low: f32, high: f32) {
        let (list, bounds) = (&self.list, &self.bounds);
        let key = |&place: &u32| {
            let at = bounds.middle(list.item(place));
            Key::new(list.priority(place), Diamond::at(at), list.record(place))
        };
        if !self.found.is_empty() {
            self.splits.extend(self.found.iter().map(key));
            self.foresee_first_splits();
        }
        if !self.found_merges.is_empty() {
            self.merges.extend(self.found_merges.iter().map(|place| key(place).reversed()));
            self.foresee_first_merges();
        }
        self.band = (low, high);
    }

    /// The band that a frame needs that is not stopped.
    pub(super) fn whole_band(&self) -> (f32, f32) {
        let border = self.border.max(self.tolerance);
        ((border / BAND).max(self.tolerance), border * BAND)
    }

    /// The next that is to be split, and the next that is to be merged.
    fn next(&mut self) -> (Option<Key>, Option<Key>) {
        let (mut top, mut last) = (self.splits.peek(), self.merges.peek());
        while top.is_some_and(|top| !self.valid(top, SPLIT)) {
            self.splits.pop();
            top = self.splits.peek();
        }
        while last.is_some_and(|last| !self.valid(last.reversed(), MERGE)) {
            self.merges.pop();
            last = self.merges.peek();
        }
        (top, last.map(Key::reversed))
    }

    /// Splits and merges until the queues agree; whether it was stopped.
    pub(super) fn balance(&mut self, stop: &mut dyn FnMut() -> bool) -> bool {
        let (budget, tolerance) = (self.budget(), self.tolerance);
        let border = self.border.max(tolerance);
        let (low, high) = self.whole_band();
        let mut pressed = self.urgent.is_some();
        if !pressed && self.band.1 < 0.0 {
            self.widen(low, high);
        }
        let mut wider = BAND;
        let mut steps = 0u32;
        let mut stopped = false;
        loop {
            self.ready.clear();
            steps += 1;
            if steps.is_multiple_of(16) && stop() {
                stopped = true;
                break;
            }
            // What is no longer true is dropped when its turn comes; until then it stands for what is behind it.
            let (top, last) = (self.splits.peek(), self.merges.peek().map(Key::reversed));
            let agreed = matches!((top, last), (Some(top), Some(last)) if top < last) && self.triangles + 1 >= budget;
            if pressed && (agreed || top.is_none() || last.is_none()) {
                // There is time for what is less urgent.
                pressed = false;
                self.splits.clear();
                self.merges.clear();
                self.band = (f32::INFINITY, -1.0);
                self.widen(low, high);
                continue;
            }
            let merging = match (top, last) {
                _ if self.triangles > budget => true,
                // Nothing is split that need not be; but first comes what is missing, lest a stopped frame only lose triangles.
                (None, Some(last)) if last.number() <= tolerance => true,
                (Some(top), _) if !self.valid(top, SPLIT) => {
                    self.splits.pop();
                    continue;
                }
                (Some(top), _) => {
                    let known = &self.records[top.record() as usize];
                    if self.triangles + cost(known, Diamond::at(known.at)) <= budget {
                        self.splits.pop();
                        self.foresee_splits();
                        self.split(top.record());
                        continue;
                    }
                    match last {
                        Some(last) if last < top => true,
                        Some(_) => break,
                        None if top.number() > self.band.1 => true,
                        None => break,
                    }
                }
                (None, _) => {
                    let (_, last) = self.next();
                    // Is there anything below the band, for which there is room or something lower to be merged?
                    let full = self.triangles + 1 > budget;
                    if self.band.0 <= tolerance || full && last.is_none_or(|last| last.number() > self.band.0) {
                        break;
                    }
                    wider *= wider;
                    let low = if wider.is_finite() { self.band.0 / wider } else { 0.0 };
                    self.widen(low.max(tolerance), self.band.1);
                    continue;
                }
            };
            if merging {
                match last {
                    Some(last) => {
                        self.merges.pop();
                        if !self.valid(last, MERGE) {
                            continue;
                        }
                        self.foresee_merges();
                        self.merge(last.record());
                    }
                    None if self.band.1 == f32::INFINITY => break,
                    None => {
                        wider *= wider;
                        let high =
                            if wider.is_finite() { self.band.1.max(f32::MIN_POSITIVE) * wider } else { f32::INFINITY };
                        self.widen(self.band.0, high);
                    }
                }
            }
        }
        self.urgent = stopped.then(|| {
            let (low, high) =
                (self.splits.urgent().map(Key::number), self.merges.urgent().map(|key| key.reversed().number()));
            // Where there were few, rather some more.
            let before = if pressed { self.band } else { (0.0, f32::INFINITY) };
            (low.unwrap_or(before.0 / 1.1), high.unwrap_or(before.1 * 1.1))
        });
        if !stopped {
            let (top, last) = self.next();
            self.border = top.or(last).map_or(border, Key::number).max(tolerance);
        }
        stopped
    }

    /// Begins to load what the coming splits will ask for, one hop of the chain at a time.
    #[inline]
    fn foresee_splits(&self) {
        self.foresee_room();
        for (hop, ahead) in AHEAD.into_iter().enumerate() {
            if let Some(key) = self.splits.coming(ahead) {
                self.foresee_split(key.record(), hop);
            }
        }
    }

    /// The same for merges.
    #[inline]
    fn foresee_merges(&self) {
        for (hop, ahead) in AHEAD.into_iter().take(3).enumerate() {
            if let Some(key) = self.merges.coming(ahead) {
                self.foresee_merge(key.reversed().record(), hop);
            }
        }
    }

    /// What the first splits ask for, so far as later ones will have been foreseen when they are next.
    fn foresee_first_splits(&self) {
        for (hop, ahead) in AHEAD.into_iter().enumerate() {
            let first = (0..ahead).map_while(|step| self.splits.coming(step));
            first.for_each(|key| self.foresee_split(key.record(), hop));
        }
    }

    /// The same for merges.
    fn foresee_first_merges(&self) {
        for (hop, ahead) in AHEAD.into_iter().take(3).enumerate() {
            let first = (0..ahead).map_while(|step| self.merges.coming(step));
            first.for_each(|key| self.foresee_merge(key.reversed().record(), hop));
        }
    }
}

/// How many steps before its turn each hop of the chain from a record to its neighbours is loaded.
const AHEAD: [usize; 4] = [12, 9, 6, 3];
