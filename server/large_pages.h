/// The memory of the process, for a loop that goes through all of it in every tick.
#pragma once

#include <cstddef>

namespace cradle {

/// Lets the process keep what memory it has had, in large pages (2 MB instead of 4 kB) where the
/// system gives them. A tick of a heap goes through some ten megabytes, of which a processor knows
/// the addresses of a part only, and while a scene grows every new small page makes it wait, for
/// some 10 us on a virtual machine. For a program that is about a world: once, as it starts, before
/// there are other threads. A quarter of the machine's memory is set aside, which counts as address
/// space alone until it is used. Where the system says no, nothing but time is lost.
void keep_memory_in_large_pages();

/// Uses so many bytes of it now, for whatever comes: as a world grows, ticks do not wait for pages
/// then. The first use of a large page takes 0.1 ms, and 6 ms on a virtual machine whose host looks
/// for that memory only then. After a fork the child has to do so by itself. False: there is not so
/// much. Of what is not kept, as above, it is in vain.
bool take_memory(std::size_t size);

}  // namespace cradle
