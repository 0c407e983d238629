// Writes what fuzzing begins with: fuzz_seeds FOLDER makes FOLDER/<target>/seed_<name>, among them
// a whole message of every kind.
#include <array>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "tests/fuzz/command_maker.h"
#include "tests/wire/layout.h"
#include "tests/wire/samples.h"

namespace cradle::fuzz {
namespace {

class Seeds {
 public:
  explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void write(const std::string& target, const std::string& name, const Bytes& bytes) const {
    std::filesystem::create_directories(folder_ / target);
    std::ofstream file(folder_ / target / ("seed_" + name), std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    if (!file) throw std::runtime_error("cannot write into " + folder_.string());
  }

 private:
  std::filesystem::path folder_;
};

void append(Bytes& bytes, ByteView more) { bytes.insert(bytes.end(), more.begin(), more.end()); }
void append(Bytes& bytes, const std::string& text) {
  bytes.insert(bytes.end(), text.begin(), text.end());
}
/// As Input::any reads it.
void append_length(Bytes& bytes, std::size_t length) {
  bytes.push_back(static_cast<std::uint8_t>(length));
  bytes.push_back(static_cast<std::uint8_t>(length >> 8));
}

std::string suffix(MessageKind kind) {
  const std::string name = Channels("w").name(kind);
  return name.substr(name.rfind('_') + 1);
}

void write_decoders(const Seeds& seeds) {
  test::Samples samples(41);
  for (const MessageKind kind : test::kAllKinds) {
    for (const std::size_t items : {0u, 1u, 3u}) {
      Bytes bytes{static_cast<std::uint8_t>(kind)};
      append(bytes, test::bytes_of(samples.message(kind, items)));
      if (items == 3) bytes.resize(bytes.size() + limits::kTrailerBytes);
      seeds.write("decoders", suffix(kind) + "_" + std::to_string(items), bytes);
    }
  }
}

/// Counts that lie: with the size that their product with an item's wraps to, or would have below
/// zero.
void write_liars(const Seeds& seeds) {
  test::Samples samples(44);
  for (const MessageKind kind : test::kAllKinds) {
    const auto [fixed, item] = test::layout_of(kind);
    if (item == 0) continue;
    const auto write = [&, at = test::kCountAt](const std::string& name, std::int32_t count,
                                                std::size_t size) {
      Bytes payload = test::bytes_of(samples.message(kind, 3));
      payload.resize(size);
      test::write_field(payload, at, count);
      Bytes bytes{static_cast<std::uint8_t>(kind)};
      append(bytes, payload);
      seeds.write("decoders", suffix(kind) + name, bytes);
    };
    write("_too_many", 4, fixed + 3 * item);
    write("_wraps", 1 << 29, fixed);
    if (fixed + limits::kTrailerBytes >= item + test::kCountAt + 4) {
      write("_negative", -1, fixed + limits::kTrailerBytes - item);
    }
  }
}

/// One datagram of a receiver's input; `sender` 3 is the one that sends unicast.
void append_datagram(Bytes& bytes, int sender, bool has_header, const Bytes& rest) {
  bytes.push_back(static_cast<std::uint8_t>(sender));
  bytes.push_back(has_header ? 0 : 1);
  append_length(bytes, rest.size());
  append(bytes, rest);
}

Bytes channel_and(const std::string& channel, const Bytes& payload) {
  Bytes bytes;
  append(bytes, channel);
  bytes.push_back(0);
  append(bytes, payload);
  return bytes;
}

void write_receiver(const Seeds& seeds) {
  test::Samples samples(42);
  Bytes all;
  for (const MessageKind kind : test::kAllKinds) {
    const Bytes rest =
        channel_and("CRADLE_w_" + suffix(kind), test::bytes_of(samples.message(kind, 1)));
    Bytes one;
    append_datagram(one, 0, true, rest);
    seeds.write("receiver", suffix(kind), one);
    append_datagram(all, static_cast<int>(kind) % 4, true, rest);
  }
  seeds.write("receiver", "all_kinds_of_four_senders", all);

  // What crashes liblcm 1.3.1: a first fragment, and one with an offset that wraps.
  Bytes fragments;
  const Bytes first = {'L', 'C', '0', '3', 0, 0, 0, 7, 0,   1, 0x86, 0xa0,
                       0,   0,   0,   0,   0, 0, 0, 2, 'A', 0, 1,    2};
  const Bytes second = {'L',  'C',  '0',  '3',  0,    0, 0, 7, 0, 1, 0x86,
                        0xa0, 0xff, 0xff, 0xff, 0xf0, 0, 1, 0, 2, 1, 2};
  append_datagram(fragments, 1, false, first);
  append_datagram(fragments, 1, false, second);
  append_datagram(fragments, 0, true, channel_and("A", {1}));
  seeds.write("receiver", "fragments_that_wrap", fragments);

  Bytes edges;
  append_datagram(edges, 0, true, {});
  append_datagram(edges, 0, false, {});
  append_datagram(edges, 0, false, {'L', 'C', '0', '2'});
  append_datagram(edges, 0, true, channel_and("", {}));
  append_datagram(edges, 0, true, channel_and(std::string(63, 'c'), {1}));
  append_datagram(edges, 0, true, channel_and(std::string(64, 'c'), {1}));
  append_datagram(edges, 0, true, Bytes(100, 'c'));
  seeds.write("receiver", "edges", edges);
}

/// A datagram of a commands' input, byte for byte.
void append_command(Bytes& bytes, const Command& command) {
  const Bytes payload = encode(command);
  bytes.push_back(1);
  bytes.push_back(static_cast<std::uint8_t>(kind_of(command.body)));
  append_length(bytes, payload.size());
  append(bytes, payload);
}

void write_commands(const Seeds& seeds) {
  BodySpec ball;
  ball.shape = Shape::sphere(0.5);
  ball.p_WBo = {0, 0, 0.4};
  BodySpec box = ball;
  box.shape = Shape::box({1, 1, 1});
  box.name = "box";
  BodySpec cone;  // its centre of mass is not its origin, its principal axes are not its own
  cone.shape = Shape::cone(0.5, 1);
  cone.inertia_kgm2 = {2, 2, 1};
  cone.inertia_products_kgm2 = {0, 0, 0.25};
  cone.sets_centre_of_mass = true;
  cone.p_BoBcm = {0.25, 0, -1};
  BodySpec ground;
  ground.kind = BodyKind::fixed;
  ground.shape = Shape::half_space();
  Wrench push;
  push.body = {2};
  push.value = {1, 2, 3};
  const Motion motion{{3}, true, true, {0, 0, 2}, {}, {1, 0, 0}, {0, 0, 1}};
  const std::vector<CommandBody> bodies = {Hello{kProtocolVersion, "seed"},
                                           Spawn{{ground, ball, box}},
                                           Spawn{{cone}},
                                           Push{{push}},
                                           ClearWrenches{{{2}}},
                                           SetMotion{{motion}},
                                           SetGravity{{0, 0, -1}},
                                           Control{ControlAction::pause, 0},
                                           Control{ControlAction::step, 3},
                                           Control{ControlAction::resume, 0},
                                           Despawn{{{3}}},
                                           Spawn{{box}}};  // its name is free again
  Bytes honest(4, 0);                                      // settings and rights
  std::int64_t sequence = 0;
  for (const CommandBody& body : bodies) {
    append_command(honest, {{1, ++sequence, CommandMaker::kEpoch, 0}, body});
    honest.push_back(0);  // a tick
  }
  seeds.write("commands", "every_kind", honest);
}

using Points = std::vector<std::array<double, 3>>;
using Triangles = std::vector<std::array<std::int8_t, 3>>;

/// As the target `geometry` draws them: what, form "any bits", scale, count, numbers.
Bytes points_of(std::uint8_t what, const Points& points) {
  Bytes bytes{what, 0, 0, static_cast<std::uint8_t>(points.size())};
  for (const auto& point : points) {
    std::uint8_t plain[sizeof point];
    std::memcpy(plain, point.data(), sizeof point);
    bytes.insert(bytes.end(), plain, plain + sizeof point);
  }
  return bytes;
}

void write_geometry(const Seeds& seeds) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Points cube = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                       {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
  const auto scaled = [&](double x, double y, double z) {
    Points points = cube;
    for (auto& p : points) p = {x * p[0], y * p[1], z * p[2]};
    return points;
  };
  const auto with = [](Points points, const std::array<double, 3>& more) {
    points.push_back(more);
    return points;
  };
  const auto hull = [&](const std::string& name, const Points& points) {
    Bytes bytes = points_of(0, points);
    append(bytes, Bytes{10, 20, 30, 40, 50, 60});  // a pose for contacts
    seeds.write("geometry", "hull_" + name, bytes);
  };
  hull("cube", cube);
  hull("needle", scaled(1e-3, 1e-3, 1e3));
  hull("huge", scaled(1e6, 1e6, 1e6));
  hull("small", scaled(2e-4, 2e-4, 2e-4));
  hull("flat", scaled(1, 1, 0));
  hull("thin", scaled(1e3, 1e3, 2e-4));
  hull("line", scaled(1, 0, 0));
  hull("one_place", scaled(0, 0, 0));
  hull("duplicates", with(with(cube, cube[3]), cube[7]));
  hull("inner_point", with(cube, {0.5, 0.5, 0.5}));
  hull("on_a_face", with(with(cube, {0.5, 0.5, 1}), {0.25, 0.5, 1 + 1e-15}));
  hull("not_finite", with(cube, {0, kNan, 0}));
  hull("far_away", with(cube, {1e7, 0, 0}));

  const Triangles sides = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                           {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const auto mesh = [&](const std::string& name, const Points& points, const Triangles& triangles) {
    Bytes bytes = points_of(1, points);
    bytes.push_back(static_cast<std::uint8_t>(triangles.size()));
    for (const auto& corners : triangles) {
      for (const std::int8_t corner : corners) bytes.push_back(static_cast<std::uint8_t>(corner));
    }
    append(bytes, Bytes{10, 20, 30, 40, 50, 60});
    seeds.write("geometry", "mesh_" + name, bytes);
  };
  const auto changed = [&](std::size_t k, const std::array<std::int8_t, 3>& corners) {
    Triangles triangles = sides;
    triangles[k] = corners;
    return triangles;
  };
  Triangles turned = sides;
  for (auto& corners : turned) std::swap(corners[0], corners[1]);
  mesh("cube", cube, sides);
  mesh("open", cube, Triangles(sides.begin(), sides.end() - 1));
  mesh("one_flipped", cube, changed(3, {5, 6, 7}));
  mesh("inside_out", cube, turned);
  mesh("degenerate", cube, changed(0, {0, 0, 1}));
  mesh("collinear", with(cube, {0.5, 0, 0}), changed(0, {0, 8, 1}));
  mesh("no_such_corner", cube, changed(0, {0, 2, 99}));
  mesh("below_zero", cube, changed(0, {0, 2, -1}));
  mesh("flat", scaled(1, 1, 0), sides);
  mesh("huge", scaled(1e6, 1e6, 1e6), sides);
  mesh("small", scaled(1e-6, 1e-6, 1e-6), sides);
  mesh("not_finite", scaled(1, kNan, 1), sides);
  Bytes text{2};
  append(text, std::string("# a tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1e0\n"
                           "f 1 3 2\nf 1/1 2/1 4/1\nf 1//1 4//1 3//1\nf -3 -2 -1\n"));
  seeds.write("geometry", "obj", text);
  Bytes parts{3, 3, 0, 100, 1, 2, 3, 0, 1, 90, 95, 100, 4, 5, 6, 0, 3, 0};
  append(parts, points_of(0, cube));
  parts.erase(parts.end() - 4 - 8 * 24);  // no byte for what: these are points of a part
  seeds.write("geometry", "compound", parts);
}

/// For targets that make their messages of any bytes themselves.
void write_random(const Seeds& seeds, const std::string& target) {
  test::Samples samples(43);
  for (int i = 0; i < 8; ++i) {
    Bytes random(1024);
    for (auto& byte : random) byte = static_cast<std::uint8_t>(samples.bits());
    seeds.write(target, "random_" + std::to_string(i), random);
  }
}

}  // namespace
}  // namespace cradle::fuzz

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 64;
  }
  const cradle::fuzz::Seeds seeds(arguments[1]);
  cradle::fuzz::write_decoders(seeds);
  cradle::fuzz::write_liars(seeds);
  cradle::fuzz::write_receiver(seeds);
  cradle::fuzz::write_commands(seeds);
  cradle::fuzz::write_random(seeds, "commands");
  cradle::fuzz::write_random(seeds, "worlds");
  cradle::fuzz::write_random(seeds, "client");
  cradle::fuzz::write_geometry(seeds);
  cradle::fuzz::write_random(seeds, "geometry");
  return 0;
}
