/// The memory of the process, for a loop that goes through all of it in every tick.
#pragma once

namespace cradle {

/// Lets the process keep what memory it has had, in large pages (2 MB instead of 4 kB) where the
/// system gives them. A tick of a heap goes through some ten megabytes, of which a processor knows
/// the addresses of a part only, and while a scene grows every new small page makes it wait, for
/// some 10 us on a virtual machine. For a program that is about a world: once, as it starts, before
/// there are other threads. A quarter of the machine's memory is set aside, which counts as address
/// space alone until it is used. Where the system says no, nothing but time is lost.
void keep_memory_in_large_pages();

}  // namespace cradle
