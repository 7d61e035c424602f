//! Lane arrays owned by the host, and calls that pass them to machine code without a copy.

use std::marker::PhantomData;

use rtsl_ir::host::Host;

use crate::call::Instances;
use crate::component_set::ComponentSet;
use crate::lane_arrays::LaneArrays;
use crate::lanes::LaneBlock;

/// Lane arrays owned by the host: one for each component of the state or of scratch, one word for each lane.
pub struct HostLanes<'a> {
    arrays: Arrays<'a>,
    lanes: usize,
    /// The bound arrays are borrowed as if they were stored here.
    borrowed: PhantomData<&'a mut [f32]>,
}

enum Arrays<'a> {
    Own(Vec<*mut u32>),
    Foreign(&'a [*mut u32]),
}

impl<'a> HostLanes<'a> {
    /// Returns a table without arrays, for `components` of them with so many lanes.
    pub fn new(components: usize, lanes: usize) -> HostLanes<'a> {
        let arrays = Arrays::Own(vec![std::ptr::null_mut(); components]);
        HostLanes { arrays, lanes, borrowed: PhantomData }
    }

    /// Returns the arrays of a table of pointers, null for components that have none.
    ///
    /// # Safety
    /// Each pointer that is not null is aligned to 4 bytes and points to `lanes` words that may be read and written as
    /// long as this lives, and are not accessed otherwise meanwhile; no two arrays overlap.
    pub unsafe fn from_table(table: &'a [*mut f32], lanes: usize) -> HostLanes<'a> {
        // Safety: pointers to f32 and to u32 have the same representation.
        let table = unsafe { std::slice::from_raw_parts(table.as_ptr().cast(), table.len()) };
        HostLanes { arrays: Arrays::Foreign(table), lanes, borrowed: PhantomData }
    }

    /// Sets the array of a component.
    ///
    /// # Panics
    /// If there is no such component, or the array has too few lanes.
    pub fn bind(&mut self, component: usize, array: &'a mut [f32]) {
        assert!(array.len() >= self.lanes, "the array has room for {} lanes", self.lanes);
        match &mut self.arrays {
            Arrays::Own(table) => table[component] = array.as_mut_ptr().cast(),
            Arrays::Foreign(_) => {
                let mut table = self.table().to_vec();
                table[component] = array.as_mut_ptr().cast();
                self.arrays = Arrays::Own(table);
            }
        }
    }

    /// Returns the number of lanes.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// True if the component has an array.
    pub fn has(&self, component: u32) -> bool {
        self.table().get(component as usize).is_some_and(|array| !array.is_null())
    }

    /// Copies lanes of the components that have arrays in both.
    pub fn copy_to(&self, block: &mut LaneBlock, lanes: usize) {
        for (component, array) in self.arrays_in(block) {
            let lanes = lanes.min(self.lanes).min(block.lanes());
            // Safety: the array has so many words.
            let words = unsafe { std::slice::from_raw_parts(array, lanes) };
            block.words_mut(component)[..lanes].copy_from_slice(words);
        }
    }

    /// Copies the lanes back.
    pub fn copy_from(&mut self, block: &LaneBlock, lanes: usize) {
        for (component, array) in self.arrays_in(block) {
            let lanes = lanes.min(self.lanes).min(block.lanes());
            // Safety: the array has so many words, and they are borrowed mutably along with this.
            let words = unsafe { std::slice::from_raw_parts_mut(array, lanes) };
            words.copy_from_slice(&block.words(component)[..lanes]);
        }
    }

    /// Returns the components that have arrays in both, with the arrays here.
    fn arrays_in(&self, block: &LaneBlock) -> Vec<(usize, *mut u32)> {
        let arrays = self.table().iter().copied().enumerate();
        let has = |component: usize| {
            component < block.components()
                && (!block.is_sparse() || block.has_all(&[component as u32].into_iter().collect()))
        };
        arrays.filter(|(component, array)| !array.is_null() && has(*component)).collect()
    }

    /// Returns the arrays by component, null for missing ones.
    pub fn table(&self) -> &[*mut u32] {
        match &self.arrays {
            Arrays::Own(table) => table,
            Arrays::Foreign(table) => table,
        }
    }
}

impl LaneArrays for HostLanes<'_> {
    fn lanes(&self) -> usize {
        self.lanes
    }

    fn missing_component(&self, components: &ComponentSet) -> Option<u32> {
        components.iter().find(|component| !self.has(*component))
    }

    fn missing_array(&self, arrays: u32) -> Option<u32> {
        (0..arrays).find(|array| !self.has(*array))
    }
}

impl std::fmt::Debug for HostLanes<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "HostLanes({} components, {} lanes)", self.table().len(), self.lanes)
    }
}

/// The arguments of a call with lane arrays owned by the host; see [`CallArguments`](crate::CallArguments).
pub struct HostArguments<'a, 'lanes> {
    /// The state.
    pub state: &'a mut HostLanes<'lanes>,
    /// Scratch: one array for each of the class's scratch scalars.
    pub scratch: &'a mut HostLanes<'lanes>,
    /// The number of rays, which the arrays hold, rounded up to a multiple of the kernel's width. 1 for the single
    /// mode.
    pub count: usize,
    /// The mask, 0 or -1 for each lane; all rays are active if `None`. The single mode takes none.
    pub mask: Option<&'a [i32]>,
    /// For `intersect`: the kernel stores 0 or -1 for each lane.
    pub accepted: Option<&'a mut [i32]>,
    /// The objects, in the form that the kernel's call mode requires. The leaf mode takes
    /// [`LeafArguments`](crate::LeafArguments) instead.
    pub instances: Instances<'a>,
    /// The host, which answers the shader's requests.
    pub host: &'a mut dyn Host,
}
