#include <cmath>

#include "scene/assemble/outputs.h"

/// Outputs of the orbit: of its point, which is the end of the state, about the planet's centre.
namespace porthos::scene {

double Outputs::of_orbit(const Item& item, const phs::State& s) const {
  const double* x = s.x.data() + s.x.size() - 6;
  const space::Planet& planet = scene_.orbit->environment.planet;
  if (item.output->quantity == OutputQuantity::altitude)
    return std::hypot(x[0], x[1], x[2]) - planet.radius;
  const auto o = space::elements_of(planet.mu, {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}});
  switch (item.output->quantity) {
    case OutputQuantity::semi_major_axis:
      return o.semi_major_axis;
    case OutputQuantity::eccentricity:
      return o.eccentricity;
    case OutputQuantity::inclination:
      return o.inclination;
    default:
      return o.node;
  }
}

}  // namespace porthos::scene
