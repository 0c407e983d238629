#include <cradle/result.h>

namespace cradle {

std::string_view to_string(Result result) {
  switch (result) {
    case Result::ok:
      return "ok";
    case Result::queued:
      return "queued";
    case Result::held:
      return "held";
    case Result::unknown_client:
      return "unknown_client";
    case Result::wrong_epoch:
      return "wrong_epoch";
    case Result::bad_version:
      return "bad_version";
    case Result::malformed:
      return "malformed";
    case Result::gap:
      return "gap";
    case Result::expired:
      return "expired";
    case Result::late:
      return "late";
    case Result::too_far_ahead:
      return "too_far_ahead";
    case Result::busy:
      return "busy";
    case Result::superseded:
      return "superseded";
    case Result::not_allowed:
      return "not_allowed";
    case Result::unknown_body:
      return "unknown_body";
    case Result::not_finite:
      return "not_finite";
    case Result::out_of_range:
      return "out_of_range";
    case Result::too_large:
      return "too_large";
    case Result::over_quota:
      return "over_quota";
    case Result::duplicate_name:
      return "duplicate_name";
    case Result::bad_name:
      return "bad_name";
    case Result::bad_shape:
      return "bad_shape";
    case Result::bad_mass:
      return "bad_mass";
    case Result::bad_rotation:
      return "bad_rotation";
    case Result::bad_wrench:
      return "bad_wrench";
    case Result::wrong_kind:
      return "wrong_kind";
    case Result::out_of_plane:
      return "out_of_plane";
    case Result::timed_out:
      return "timed_out";
    case Result::no_world:
      return "no_world";
    case Result::world_restarted:
      return "world_restarted";
    case Result::no_network:
      return "no_network";
    case Result::bad_url:
      return "bad_url";
    case Result::over_window:
      return "over_window";
    case Result::recording:
      return "recording";
    case Result::bad_recording:
      return "bad_recording";
    case Result::contested:
      return "contested";
  }
  return "unlisted";
}

}  // namespace cradle
