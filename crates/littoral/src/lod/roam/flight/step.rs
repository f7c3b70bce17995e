//! The steps: splitting a diamond, and merging it again.

use super::*;

/// A diamond that is being split, and those of its children that have both triangles now.
struct Family {
    parent: u32,
    /// Vertices at the ends of its base, and at its apexes.
    corners: [u32; 4],
    /// The vertex in its middle.
    vertex: u32,
    items: [Item; 4],
    children: [u32; 4],
    whole: usize,
}

impl<G: Ground> RoamFlight<'_, G> {
    /// Vertices at the apexes.
    fn apexes(&self, known: &Record, diamond: Diamond) -> [u32; 2] {
        if diamond == Diamond::ROOT {
            return [1, 3];
        }
        known.parents.map(|parent| if parent == NONE { NONE } else { self.records[parent as usize].triangles[0] })
    }

    /// A child's other parent, if there is a record of it.
    #[inline(always)]
    pub(super) fn beyond(&self, known: &Record, diamond: Diamond, child: usize) -> u32 {
        let (through, other) = diamond.beyond(child);
        // At the border there is one parent only, whichever side it is on.
        let parent = known.parents[through & usize::from(known.parents[1] != NONE)];
        self.records.get(parent as usize).map_or(NONE, |parent| parent.children[other])
    }

    /// The record of a split diamond's child, if the child's other parent has made it.
    #[inline(always)]
    fn met(&self, known: &Record, diamond: Diamond, child: usize) -> Option<u32> {
        let other = self.beyond(known, diamond, child);
        let other = self.records.get(other as usize).filter(|other| other.split)?;
        Some(other.children[child ^ 2]).filter(|&child| child != NONE)
    }

    /// Splits a diamond that has both triangles.
    pub(super) fn split(&mut self, record: u32) {
        let known = self.records[record as usize];
        let diamond = Diamond::at(known.at);
        // Four times the same, for the compiler to know which way the base runs.
        match diamond.base {
            base @ Base::Rising => self.divide(record, &known, Diamond { base, ..diamond }),
            base @ Base::Falling => self.divide(record, &known, Diamond { base, ..diamond }),
            base @ Base::East => self.divide(record, &known, Diamond { base, ..diamond }),
            base @ Base::North => self.divide(record, &known, Diamond { base, ..diamond }),
        }
    }

    #[inline(always)]
    fn divide(&mut self, record: u32, known: &Record, diamond: Diamond) {
        self.operations.0 += 1;
        self.triangles += cost(known, diamond);
        self.freed.extend(known.triangles.into_iter().filter(|&slot| slot != NONE));
        let slot = self.set_vertex(record, known.at);
        let own = &mut self.records[record as usize];
        (own.split, own.triangles) = (true, [slot, NONE]);
        for parent in known.parents {
            if parent != NONE {
                self.records[parent as usize].kids += 1;
                if self.records[parent as usize].list == MERGE {
                    self.leave(parent);
                }
            }
        }
        let [a, b] = known.ends;
        let [p, q] = self.apexes(known, diamond);
        let corners = [a, b, p, if q == NONE { p } else { q }];
        let mut family =
            Family { parent: record, corners, vertex: slot, items: [Item::NOTHING; 4], children: [NONE; 4], whole: 0 };
        self.bear(known, diamond, 0, &mut family);
        self.bear(known, diamond, 1, &mut family);
        self.bear(known, diamond, 2, &mut family);
        self.bear(known, diamond, 3, &mut family);
        self.join_all(&family);
        self.turn(record, diamond, MERGE);
    }

    /// The vertex that a split adds.
    #[inline(always)]
    fn set_vertex(&mut self, record: u32, at: Point) -> u32 {
        let vertex = self.vertex(at);
        let slot = match self.unused_vertices.pop() {
            Some(slot) => {
                self.mesh.vertices[slot as usize] = vertex;
                self.makers[slot as usize] = record;
                slot
            }
            None => {
                self.mesh.vertices.push(vertex);
                self.makers.push(record);
                self.mesh.vertices.len() as u32 - 1
            }
        };
        Changes::mark(&mut self.changed.vertices, slot);
        slot
    }

    /// Makes a child of a diamond that is being split, or finds that of its other parent, and draws its triangle.
    #[inline(always)]
    fn bear(&mut self, known: &Record, diamond: Diamond, i: usize, family: &mut Family) {
        let Some(child) = diamond.child(i) else { return };
        let ends = diamond.child_ends(family.corners, i);
        let of = match self.met(known, diamond, i) {
            Some(of) => of,
            None => self.record(child, ends, self.bounds.bound(child)),
        };
        let border = at_border(child);
        let side = if border { 0 } else { diamond.side_of(i) };
        self.records[family.parent as usize].children[i] = of;
        let held = &mut self.records[of as usize];
        held.parents[side] = family.parent;
        held.held += 1;
        let bound = held.bound;
        if held.held == if border { 1 } else { 2 } {
            family.items[family.whole] = self.bounds.item(bound, child, self.idle(child), of);
            family.children[family.whole] = of;
            family.whole += 1;
        }
        if bound.whole(side) {
            let ([a, b], apex) = (ends, family.vertex);
            self.put(of, side, if i < 2 { [a, b, apex] } else { [b, a, apex] });
        }
    }

    /// Puts children that have both triangles in the list.
    #[inline(always)]
    fn join_all(&mut self, family: &Family) {
        let lens = self.lens.as_ref();
        let together = lens.filter(|_| family.whole > 1).and_then(|lens| self.bounds.priorities(lens, &family.items));
        for i in 0..family.whole {
            let (item, child) = (family.items[i], family.children[i]);
            let diamond = Diamond::at(self.records[child as usize].at);
            let slopes = self.bounds.slopes(diamond);
            let alone = || self.lens.as_ref().map_or(0.0, |lens| self.bounds.priority(lens, &item, slopes));
            let priority = together.map_or_else(alone, |priorities| priorities[i]);
            let kind = (item.word & 3) as u8;
            let place = self.list.add(item, slopes, priority, kind);
            let known = &mut self.records[child as usize];
            (known.place, known.list) = (place, kind);
            self.enqueue(child, diamond, kind, priority);
        }
    }

    /// Merges a split diamond that has no split child.
    pub(super) fn merge(&mut self, record: u32) {
        let known = self.records[record as usize];
        let diamond = Diamond::at(known.at);
        self.operations.1 += 1;
        self.triangles -= cost(&known, diamond);
        for child in known.children {
            if child == NONE {
                continue;
            }
            let of = &mut self.records[child as usize];
            let side = usize::from(of.parents[0] != record);
            if of.triangles[side] != NONE {
                self.freed.push(of.triangles[side]);
                of.triangles[side] = NONE;
            }
            of.parents[side] = NONE;
            of.held -= 1;
            let (list, held) = (of.list, of.held);
            if list != NOWHERE {
                self.leave(child);
            }
            if held == 0 {
                self.unused.push(child);
            }
        }
        self.bounds.forget(known.triangles[0]);
        self.unused_vertices.push(known.triangles[0]);
        let own = &mut self.records[record as usize];
        (own.split, own.triangles, own.children) = (false, [NONE; 2], [NONE; 4]);
        let apexes = self.apexes(&known, diamond);
        for (side, apex) in apexes.into_iter().enumerate() {
            if apex != NONE {
                self.draw(record, diamond, side, apex);
            }
        }
        let kind = self.idle(diamond);
        self.turn(record, diamond, kind);
        for parent in known.parents {
            if parent != NONE {
                self.records[parent as usize].kids -= 1;
                if self.records[parent as usize].kids == 0 {
                    self.join(parent, MERGE);
                }
            }
        }
    }
}
