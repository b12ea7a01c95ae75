#include "space/plates.h"

#include "mechanics/rotation.h"

namespace porthos::space {

PlateForces::PlateForces(const Mechanism& m, const std::vector<Plate>& plates)
    : on_(m), mass_(m.total_mass()) {
  for (const Plate& p : plates) {
    const auto& body = m.body(p.link);
    const Vec3d normal = (1 / mechanics::norm(p.normal)) * p.normal;
    plates_.push_back({p,
                       size_t(body.node),
                       body.pose.R * normal,
                       body.pose.R * p.place + body.pose.r,
                       {0, 0, 0},
                       {0, 0, 0},
                       {0, 0, 0}});
  }
}

void PlateForces::place(std::span<const double> q) {
  on_.place(q);
  for (auto& p : plates_) {
    p.n = on_.axes(p.node) * p.normal;
    p.drag = p.light = {0, 0, 0};
  }
}

Vec3d PlateForces::drag(const Vec3d& through, double density) {
  const double speed = mechanics::norm(through);
  const Vec3d v = on_.base().tmul(through);
  Vec3d sum{0, 0, 0};
  for (auto& p : plates_) {
    const double facing = dot(p.n, v) / speed;
    p.drag = facing > 0 ? (-0.5 * density * p.plate.drag * p.plate.area * facing * speed) * v
                        : Vec3d{0, 0, 0};
    sum += p.drag;
  }
  return on_.base() * sum;
}

Vec3d PlateForces::light(const Vec3d& to_sun, double pressure) {
  const Vec3d s = on_.base().tmul(to_sun);
  Vec3d sum{0, 0, 0};
  for (auto& p : plates_) {
    const double facing = dot(p.n, s), mirror = p.plate.specular, matt = p.plate.diffuse;
    p.light = facing > 0 ? (-pressure * p.plate.area * facing) *
                               ((1 - mirror) * s + 2 * (mirror * facing + matt / 3) * p.n)
                         : Vec3d{0, 0, 0};
    sum += p.light;
  }
  return on_.base() * sum;
}

void PlateForces::project() {
  Vec3d whole{0, 0, 0};
  for (const auto& p : plates_) {
    const Vec3d both = p.drag + p.light, f = on_.axes(p.node).tmul(both);
    whole += both;
    on_.wrench(p.node) += {cross(p.place, f), f};
  }
  const auto& links = on_.links();
  for (size_t i = 0; i < links.size(); ++i) {
    const Vec3d f = on_.axes(i).tmul((-links[i].m / mass_) * whole);
    on_.wrench(i) += {cross(links[i].c, f), f};
  }
  on_.project();
}

}  // namespace porthos::space
