//! Functions for full chunks that take their arguments in registers.
//!
//! A kernel that interleaves has a function for full chunks only. If that has no loop but the one over chunks and needs
//! nothing of a call but the tables of arrays, the accepted rays and the instance, these are its arguments. A caller
//! whose rays fill whole chunks calls it directly: no struct is written and read back, and no mask and no remainder are
//! tested. On a Zen 5 with 16 lanes this is 6 percent of the time of an exponential for 64 rays.

use rtsl_abi::offsets;
use rtsl_packet::Kernel;
use rtsl_packet::kernel::{OpKind, Region};

use crate::emitter::{Emitter, PointerSource, load_word};
use crate::operand::Operand;

/// The fields of a call that the function takes, in the order of its parameters; the number of rays follows them.
const ARGUMENTS: [u32; 4] =
    [offsets::CALL_STATE, offsets::CALL_SCRATCH, offsets::CALL_ACCEPTED, offsets::CALL_INSTANCE];

/// The function for full chunks of a kernel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FullChunks {
    /// The symbol of a function `void (ptr state, ptr scratch, ptr accepted, ptr instance, i64 count)`, whose pointers
    /// are those of a call.
    pub symbol: String,
    /// The number of rays of which `count` is a multiple, at least one: a power of two.
    pub rays: u32,
}

impl FullChunks {
    /// Returns the function of the kernel with this symbol; `None` if none takes its arguments in registers.
    pub fn of(kernel: &Kernel, symbol: &str) -> Option<FullChunks> {
        let interleave = kernel.interleave?;
        takes_arguments(kernel).then(|| FullChunks {
            symbol: format!("{symbol}.full"),
            rays: kernel.width * interleave,
        })
    }

    /// Returns the kernel's function for any call, which calls this one for the full chunks, and another for the rest.
    pub(crate) fn caller(&self, symbol: &str, attributes: &str) -> String {
        let FullChunks { symbol: full, rays } = self;
        let count = count_of_full_chunks(*rays);
        let mut loads = String::new();
        let mut arguments = String::new();
        for field in ARGUMENTS {
            loads.push_str(&format!(
                "  %at.{field} = getelementptr i8, ptr %call, i64 {field}
  %argument.{field} = load ptr, ptr %at.{field}, align 8
"
            ));
            arguments.push_str(&format!("ptr %argument.{field}, "));
        }
        format!(
            "define void @\"{symbol}\"(ptr noalias %call) {attributes} {{
entry:
{count}  br i1 %none, label %rest, label %full
full:
{loads}  call void @\"{full}\"({arguments}i64 %count)
  %all = icmp eq i64 %count, %count.all
  br i1 %all, label %end, label %rest
rest:
  tail call void @\"{symbol}.rest\"(ptr %call, i64 %count)
  br label %end
end:
  ret void
}}

"
        )
    }

    /// Returns the head of the function's definition; begins an emitter's function whose pointers are its parameters.
    pub(crate) fn header(&self, emitter: &mut Emitter<'_, '_>) -> String {
        let parameters = ARGUMENTS.map(|field| {
            let parameter = emitter.new_local();
            emitter.set_pointer(PointerSource::Call, field, parameter);
            parameter
        });
        let parameters: String =
            parameters.iter().map(|it: &Operand| format!("ptr noundef {it}, ")).collect();
        format!("hidden void @\"{}\"({parameters}i64 noundef %count)", self.symbol)
    }
}

/// Returns the definitions of `%count`, the number of the call's rays in full chunks of so many, 0 if it has a mask,
/// and of `%none`, true if there are none.
pub fn count_of_full_chunks(rays: u32) -> String {
    let count = load_word("count", offsets::CALL_COUNT, "%count.all");
    let mask = offsets::CALL_MASK;
    format!(
        "{count}  %mask.at = getelementptr i8, ptr %call, i64 {mask}
  %mask = load ptr, ptr %mask.at, align 8
  %unmasked = icmp eq ptr %mask, null
  %whole = and i64 %count.all, -{rays}
  %count = select i1 %unmasked, i64 %whole, i64 0
  %none = icmp eq i64 %count, 0
"
    )
}

/// True if the function needs nothing else of a call, and has no loop, beside which the time of a call does not count.
fn takes_arguments(kernel: &Kernel) -> bool {
    let reports = reports_budget(&kernel.prologue) || reports_budget(&kernel.body);
    let is_simple = kernel.signature().is_plain() && !kernel.asks_host() && !reports;
    is_simple && !kernel.body.has_loop()
}

/// True if code stores the status of the call.
fn reports_budget(region: &Region) -> bool {
    let reports =
        |kind: &OpKind| matches!(kind, OpKind::ReportBudget) || kind.regions().any(reports_budget);
    region.ops.iter().any(|op| reports(&op.kind))
}
