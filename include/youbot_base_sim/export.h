#pragma once

/// Marks what the library youbot_base_sim::core exports: the functions and classes that docs/library.md promises. All
/// else is hidden, inline functions too, so that no other definition of theirs can replace one within the library.
#define YOUBOT_BASE_SIM_EXPORT [[gnu::visibility("default")]]
