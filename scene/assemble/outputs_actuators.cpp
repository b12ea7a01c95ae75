#include <fmt/format.h>

#include <algorithm>

#include "scene/assemble/outputs.h"

/// Outputs of actuators: their springs and motors.
namespace porthos::scene {

void Outputs::bind_actuator(Item& item) {
  const Output& o = *item.output;
  const auto& all = scene_.actuators;
  const auto a = std::find_if(all.begin(), all.end(),
                              [&](const JointActuator& j) { return j.name == o.of_what; });
  if (a == all.end())
    refuse_output(
        o,
        "there is no [[actuator]] '" + o.of_what + "', expected " +
            (all.empty() ? "one" : "one of: " + listed(all, [](const auto& j) { return j.name; })));
  item.actuator = &a->actuator;
  const auto& traits = a->actuator.elastic->traits();
  if ((o.quantity == OutputQuantity::stiffness_setting || o.number == "sigma") &&
      traits.sigma.empty())
    refuse_output(o, fmt::format("the energy of actuator '{}' ('{}') does not depend on sigma, "
                                 "expected another quantity",
                                 a->name, traits.family));
  item.at = place_of(*a, assembly_.model->description());
  item.gone = item.at.link < 0;
}

double Outputs::of_actuator(const Item& item, const phs::State& s) const {
  const double q = s.x[size_t(item.at.link)], theta = s.x[size_t(item.at.theta)];
  const double sigma = item.at.sigma < 0 ? 0 : s.x[size_t(item.at.sigma)];
  const vsa::Elastic& spring = *item.actuator->elastic;
  switch (item.output->quantity) {
    case OutputQuantity::deflection:
      return q - theta;
    case OutputQuantity::stiffness_setting:
      return sigma;
    case OutputQuantity::stiffness:
      return spring.stiffness(q, theta, sigma);
    case OutputQuantity::spring_torque:
      return -spring.slopes(q, theta, sigma).q;
    default:
      return of_motor(item, spring.slopes(q, theta, sigma));
  }
}

/// What acts on the rotor beside spring and losses: a command, a controller of the drive or of the
/// scene. Without a rotor the drive holds the spring.
double Outputs::of_motor(const Item& item, const vsa::Slopes<double>& slopes) const {
  const bool of_sigma = item.output->number == "sigma";
  const double rate = field_[size_t(of_sigma ? item.at.sigma : item.at.theta)];
  if (item.output->quantity == OutputQuantity::motor_rate) return rate;
  const double slope = of_sigma ? slopes.sigma : slopes.theta;
  const int momentum = of_sigma ? item.at.momentum_of_sigma : item.at.momentum_of_theta;
  if (momentum < 0) return slope;
  return field_[size_t(momentum)] + slope -
         vsa::rotor_losses(*item.actuator, of_sigma, rate, field_[size_t(item.at.link)]);
}

}  // namespace porthos::scene
