#include "world_commands.h"

#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

namespace cradle::tool {
namespace {

using Triple = std::array<double, 3>;
using Quadruple = std::array<double, 4>;

Vec3 vec3(const Triple& t) { return {t[0], t[1], t[2]}; }

/// Adds an option of three numbers that fills a vector.
CLI::Option* add_vector(CLI::App* app, const std::string& flag, Vec3& value,
                        const std::string& help) {
  return app
      ->add_option_function<Triple>(
          flag, [&value](const Triple& t) { value = vec3(t); }, help)
      ->type_name("X Y Z");
}

// --- spawn ------------------------------------------------------------------------------------

struct SpawnArguments {
  BodySpec spec;
  std::vector<double> size;

  /// False if there are not as many sizes as the shape has.
  bool shape_up() {
    auto& shape = spec.shape;
    if (shape.kind == ShapeKind::polygon) {
      if (size.size() == 6) size.insert(size.end(), {size[4], size[5]});  // a triangle
      if (size.size() != 8) return false;
    } else if (size.size() != size_count(shape.kind)) {
      return false;
    }
    std::copy(size.begin(), size.end(), shape.parameters.begin());
    return true;
  }
};

int spawn(Session& session, const BodySpec& spec) {
  const Ticket ticket = session.client.spawn(spec);
  const Answer answer = session.client.wait(ticket, session.timeout);
  if (!answer) return finish(session, ticket);
  std::printf("%lld\n", static_cast<long long>(answer.body.value));
  return kExitOk;
}

/// Beyond friction and restitution.
void add_material(CLI::App* app, Material& material) {
  app->add_option("--rolling-friction", material.rolling_friction_m,
                  "greatest torque against rolling, by the normal force (m, default 0)");
  app->add_option("--torsional-friction", material.torsional_friction_m,
                  "likewise against turning about the normal (m, default 0)");
  const std::map<std::string, CombineRule> rules = {{"average", CombineRule::average},
                                                    {"geometric_mean", CombineRule::geometric_mean},
                                                    {"minimum", CombineRule::minimum},
                                                    {"multiply", CombineRule::multiply},
                                                    {"maximum", CombineRule::maximum}};
  const auto add_rule = [&](const std::string& flag, CombineRule& rule, const std::string& help) {
    app->add_option(flag, rule, help)->transform(CLI::CheckedTransformer(rules))->type_name("RULE");
  };
  add_rule("--friction-rule", material.friction_rule,
           "of two bodies: average, geometric_mean (default), minimum, multiply, maximum");
  add_rule("--restitution-rule", material.restitution_rule, "likewise (default maximum)");
}

void add_spawn(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<SpawnArguments>();
  BodySpec& spec = arguments->spec;
  spec.shape = Shape::sphere(0);
  CLI::App* sub = app.add_subcommand("spawn", "Make a body; prints its id");
  const std::map<std::string, ShapeKind> shapes = {
      {"sphere", ShapeKind::sphere},         {"box", ShapeKind::box},
      {"half_space", ShapeKind::half_space}, {"capsule", ShapeKind::capsule},
      {"cylinder", ShapeKind::cylinder},     {"cone", ShapeKind::cone},
      {"ellipsoid", ShapeKind::ellipsoid},   {"polygon", ShapeKind::polygon}};
  sub->add_option("--shape", spec.shape.kind,
                  "sphere, box, half_space (solid below its z = 0), capsule, cylinder, cone, "
                  "ellipsoid; polygon, for planar worlds")
      ->transform(CLI::CheckedTransformer(shapes))
      ->type_name("SHAPE")
      ->required();
  sub->add_option(
         "--size", arguments->size,
         "sphere: radius; box, ellipsoid: half extents x y z; polygon: x y of three or four "
         "corners, counter-clockwise; others: radius and half the length along z, of a "
         "capsule without its ends (m)")
      ->expected(0, 8)
      ->type_name("M...");
  const std::map<std::string, BodyKind> kinds = {{"dynamic", BodyKind::dynamic},
                                                 {"kinematic", BodyKind::kinematic},
                                                 {"static", BodyKind::fixed}};
  sub->add_option("--kind", spec.kind, "dynamic (default), kinematic or static")
      ->transform(CLI::CheckedTransformer(kinds))
      ->type_name("KIND");
  sub->add_option("--name", spec.name, "unique in the world");
  add_vector(sub, "--at", spec.p_WBo, "position (m)");
  sub->add_option_function<Quadruple>(
         "--rotation",
         [&spec](const Quadruple& q) {
           spec.q_WB = {q[0], q[1], q[2], q[3]};
         },
         "unit quaternion")
      ->type_name("W X Y Z");
  add_vector(sub, "--velocity", spec.v_WBcm, "of the centre of mass (m/s)");
  add_vector(sub, "--spin", spec.w_WB, "angular velocity (rad/s)");
  CLI::Option* mass = sub->add_option("--mass", spec.mass_kg, "kg");
  sub->add_option("--density", spec.density_kgpm3, "kg/m^3 (default 1000)")->excludes(mass);
  sub->add_option("--friction", spec.material.friction, "Coulomb coefficient (default 0.5)");
  sub->add_option("--restitution", spec.material.restitution, "0 .. 1 (default 0)");
  add_material(sub, spec.material);
  sub->add_option("--contact-tolerance", spec.contact_tolerance_m,
                  "what its contacts may sink in by (m, default: as the world says)");
  sub->callback([&action, arguments] {
    if (!arguments->shape_up()) {
      throw CLI::ValidationError("--size",
                                 "sphere takes 1 number, box and ellipsoid 3, half_space none, "
                                 "capsule, cylinder and cone 2, polygon 6 or 8");
    }
    action = [arguments](Session& session) { return spawn(session, arguments->spec); };
  });
}

// --- push -------------------------------------------------------------------------------------

struct PushArguments {
  std::string body;
  Wrench wrench;
  bool is_in_body_frame = false;

  void settle_frames() {
    if (!is_in_body_frame) return;
    wrench.frame = WrenchFrame::body;
    if (wrench.point_kind == WrenchPoint::world_point) wrench.point_kind = WrenchPoint::body_point;
  }
};

int push(Session& session, const PushArguments& arguments) {
  const auto bodies = find_bodies(session, {arguments.body});
  if (bodies.empty()) return kExitRefused;
  Wrench wrench = arguments.wrench;
  wrench.body = bodies.front();
  return finish(session, session.client.push(wrench));
}

void add_push(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<PushArguments>();
  Wrench& wrench = arguments->wrench;
  CLI::App* sub = app.add_subcommand("push", "Push a body, for one tick unless told otherwise");
  sub->add_option("body", arguments->body, "id or name")->required();
  CLI::App* quantities = sub->add_option_group("what", "exactly one");
  quantities->require_option(1);
  const auto add_quantity = [&](const char* flag, WrenchQuantity quantity, const char* unit) {
    quantities
        ->add_option_function<Triple>(
            flag,
            [&wrench, quantity](const Triple& t) {
              wrench.quantity = quantity;
              wrench.value = vec3(t);
            },
            unit)
        ->type_name("X Y Z");
  };
  add_quantity("--force", WrenchQuantity::force, "N");
  add_quantity("--torque", WrenchQuantity::torque, "N m");
  add_quantity("--impulse", WrenchQuantity::impulse, "N s");
  add_quantity("--angular-impulse", WrenchQuantity::angular_impulse, "N m s");
  add_quantity("--acceleration", WrenchQuantity::acceleration, "m/s^2");
  sub->add_option_function<Triple>(
         "--at",
         [&wrench](const Triple& t) {
           wrench.point_kind = WrenchPoint::world_point;
           wrench.point = vec3(t);
         },
         "point where it acts (m); default: the centre of mass")
      ->type_name("X Y Z");
  sub->add_flag("--body-frame", arguments->is_in_body_frame,
                "vector and point are in the body's frame, and turn with it");
  CLI::Option* ticks = sub->add_option_function<Tick>(
      "--ticks",
      [&wrench](Tick count) {
        wrench.duration = WrenchDuration::ticks;
        wrench.ticks = count;
      },
      "for so many ticks");
  ticks->type_name("N");
  sub->add_flag_callback(
         "--until-cleared", [&wrench] { wrench.duration = WrenchDuration::until_cleared; },
         "until `cradle clear`")
      ->excludes(ticks);
  sub->callback([&action, arguments] {
    arguments->settle_frames();
    action = [arguments](Session& session) { return push(session, *arguments); };
  });
}

// --- the others -------------------------------------------------------------------------------

/// A subcommand that takes a list of bodies.
void add_on_bodies(CLI::App& app, Action& action, const char* name, const char* help,
                   std::function<Ticket(Client&, std::span<const BodyId>)> send) {
  const auto texts = std::make_shared<std::vector<std::string>>();
  CLI::App* sub = app.add_subcommand(name, help);
  sub->add_option("body", *texts, "ids or names")->required();
  sub->callback([&action, texts, send = std::move(send)] {
    action = [texts, send](Session& session) -> int {
      const auto bodies = find_bodies(session, *texts);
      if (bodies.empty()) return kExitRefused;
      return finish(session, send(session.client, bodies));
    };
  });
}

/// A subcommand without arguments.
void add_plain(CLI::App& app, Action& action, const char* name, const char* help,
               std::function<Ticket(Client&)> send) {
  app.add_subcommand(name, help)->callback([&action, send = std::move(send)] {
    action = [send](Session& session) { return finish(session, send(session.client)); };
  });
}

void add_step(CLI::App& app, Action& action) {
  const auto ticks = std::make_shared<std::int64_t>(1);
  CLI::App* sub = app.add_subcommand("step", "Make ticks in a world that stands still");
  sub->add_option("ticks", *ticks, "how many (default 1)");
  sub->callback([&action, ticks] {
    action = [ticks](Session& session) { return finish(session, session.client.step(*ticks)); };
  });
}

void add_gravity(CLI::App& app, Action& action) {
  const auto gravity = std::make_shared<Vec3>();
  CLI::App* sub = app.add_subcommand("gravity", "Set the world's gravity");
  add_vector(sub, "gravity", *gravity, "m/s^2")->required();
  sub->callback([&action, gravity] {
    action = [gravity](Session& session) {
      return finish(session, session.client.set_gravity(*gravity));
    };
  });
}

}  // namespace

void add_world_commands(CLI::App& app, Action& action) {
  add_spawn(app, action);
  add_push(app, action);
  add_on_bodies(app, action, "remove", "Remove bodies, all or none",
                [](Client& client, auto bodies) { return client.despawn(bodies); });
  add_on_bodies(app, action, "clear", "End the pushes that still act on bodies",
                [](Client& client, auto bodies) { return client.clear_wrenches(bodies); });
  add_gravity(app, action);
  add_plain(app, action, "pause", "Stop time", [](Client& client) { return client.pause(); });
  add_plain(app, action, "resume", "Let time run", [](Client& client) { return client.resume(); });
  add_step(app, action);
  add_plain(app, action, "shutdown", "End the server, if it lets clients do that",
            [](Client& client) { return client.shutdown(); });
}

}  // namespace cradle::tool
