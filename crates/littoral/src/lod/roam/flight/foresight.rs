//! Loading memory before it is needed.
//!
//! A split touches some thirty lines of memory, up to four links away from where it begins, and a flight's records do not fit into the near caches:
//! waiting for them one after the other was nine tenths of its time. Most of what a frame changes is known when it begins, so each link of a chain
//! is asked for some steps ahead of its use. Nothing depends on it but time.

use super::super::bounds::prefetch;
use super::*;

impl<G: Ground> RoamFlight<'_, G> {
    #[inline]
    fn expect_record(&self, record: u32) {
        if let Some(record) = self.records.get(record as usize) {
            prefetch(record);
        }
    }

    #[inline]
    fn expect_triangle(&self, slot: u32) {
        if let Some(triangle) = self.mesh.triangles.get(slot as usize) {
            prefetch(triangle);
        }
    }

    /// One hop of what the split of a record asks for.
    #[inline]
    pub(super) fn foresee_split(&self, record: u32, hop: usize) {
        if hop == 0 {
            return self.expect_record(record);
        }
        let known = &self.records[record as usize];
        let diamond = Diamond::at(known.at);
        match hop {
            1 => {
                known.parents.iter().for_each(|&parent| self.expect_record(parent));
                known.triangles.iter().for_each(|&slot| self.expect_triangle(slot));
                self.bounds.expect_height(known.at);
                self.list.expect(known.place);
            }
            2 => {
                for parent in known.parents {
                    if let Some(parent) = self.records.get(parent as usize).filter(|parent| parent.list == MERGE) {
                        self.list.expect(parent.place);
                    }
                }
                (0..4).for_each(|child| self.expect_record(self.beyond(known, diamond, child)));
            }
            _ => {
                for i in 0..4 {
                    let Some(child) = diamond.child(i) else { continue };
                    let other = self.records.get(self.beyond(known, diamond, i) as usize);
                    match other.and_then(|other| self.records.get(other.children[i ^ 2] as usize)) {
                        Some(there) => prefetch(there),
                        None => self.bounds.expect_bound(child),
                    }
                }
            }
        }
    }

    /// Unused memory that the splits after the next will take.
    #[inline]
    pub(super) fn foresee_room(&self) {
        for depth in 4..9 {
            if let Some(&record) = self.unused.iter().nth_back(depth) {
                self.expect_record(record);
            }
        }
        if let Some(&vertex) = self.unused_vertices.iter().nth_back(4) {
            prefetch(&self.mesh.vertices[vertex as usize]);
            prefetch(&self.makers[vertex as usize]);
        }
        self.list.expect_room();
    }

    /// What the split of a diamond that was just made ready asks for; both of its parents are at hand.
    #[inline]
    pub(super) fn foresee_child(&self, record: u32) {
        self.foresee_split(record, 1);
        self.foresee_split(record, 2);
        let diamond = Diamond::at(self.records[record as usize].at);
        (0..4).filter_map(|i| diamond.child(i)).for_each(|child| self.bounds.expect_bound(child));
    }

    /// One hop of what the merge of a record asks for.
    #[inline]
    pub(super) fn foresee_merge(&self, record: u32, hop: usize) {
        if hop == 0 {
            return self.expect_record(record);
        }
        let known = &self.records[record as usize];
        if hop == 1 {
            known.parents.iter().chain(&known.children).for_each(|&other| self.expect_record(other));
            self.list.expect(known.place);
            return;
        }
        for (i, child) in known.children.into_iter().enumerate() {
            let Some(child) = self.records.get(child as usize) else { continue };
            if child.list != NOWHERE {
                self.list.expect(child.place);
            }
            // What is freed last is taken first.
            if i >= 2 {
                self.expect_triangle(child.triangles[usize::from(child.parents[0] != record)]);
            }
        }
    }
}
