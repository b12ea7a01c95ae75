#include "scene/read/controllers/held_law.h"

#include <fmt/format.h>

#include <algorithm>

#include "energy_shaping/loop/held_loop.h"
#include "scene/read/joint_place.h"
#include "scene/read/scene.h"

namespace porthos::scene {
namespace {

using energy_shaping::HeldLoop;

/// @param alone  the loop is the whole scene
std::string judge_hold(energy_shaping::Certificate& certificate, const Controller& c,
                       const HeldLoop& loop, bool alone) {
  energy_shaping::Certificate own;
  certify_sampled(own, loop, 1 / c.rate, c.sensing.delay);
  const energy_shaping::CertificateItem& item = own.items().front();
  if (alone || own.holds()) {
    certificate.add(item);
    energy_shaping::refuse_failure(certificate);
    return "";
  }
  certificate.report(item.name, item.value,
                     item.text + "; without the elements and actuators of the scene");
  return fmt::format(
      "'{}' would be unstable without the scene's elements and actuators: {:.4g} is the {}", c.name,
      item.value, item.text);
}

}  // namespace

std::string certify_held(energy_shaping::Certificate& certificate, const Controller& c,
                         const ControllerPlant& plant,
                         const std::vector<energy_shaping::PortLaw>& laws,
                         std::span<const double> q) {
  if (c.rate == 0) return "";
  std::vector<double> x(q.begin(), q.end());
  x.resize(size_t(plant.model->description().nx), 0.0);
  return judge_hold(certificate, c, held_loop(*plant.model, laws, x),
                    plant.scene.elements.empty() && plant.scene.actuators.empty());
}

std::string certify_held(energy_shaping::Certificate& certificate, const Controller& c,
                         const ControllerPlant& plant, const HeldNetwork& network,
                         std::span<const double> q) {
  if (c.rate == 0) return "";
  const auto build = [&](bool closed) {
    phs::Network n("plant");
    n.add("mechanism", plant.model).main("mechanism");
    network.beside(n);
    if (closed) network.laws(n);
    return n.build();
  };
  const auto plain = build(false), under = build(true);
  std::vector<double> x(size_t(plain->description().nx), 0.0);
  std::copy(q.begin(), q.end(), x.begin() + plain->offset("mechanism"));
  for (const auto& [member, own] : network.rest)
    std::copy(own.begin(), own.end(), x.begin() + plain->offset(member));
  HeldLoop loop;
  try {
    loop.A = energy_shaping::linear_plant(*plain, x).A;
    loop.K = energy_shaping::linear_plant(*under, x).A;
  } catch (const InvalidArgument& e) {
    hold_not_checked(certificate, c, e.what());
    return "";
  }
  // u = x' of the laws: what the one has and the other has not
  loop.B = phs::Matrix::identity(loop.A.rows);
  for (size_t k = 0; k < loop.K.a.size(); ++k) loop.K.a[k] = loop.A.a[k] - loop.K.a[k];
  return judge_hold(
      certificate, c, loop,
      plant.scene.elements.empty() && (network.actuators || plant.scene.actuators.empty()));
}

HeldNetwork with_actuators(const ControllerPlant& plant, std::span<const double> q,
                           const std::vector<double>& theta,
                           std::function<void(phs::Network&)> laws) {
  const auto& all = plant.scene.actuators;
  HeldNetwork network;
  network.beside = [&plant](phs::Network& n) {
    add_actuators(n, *plant.model, plant.scene.actuators);
  };
  network.laws = std::move(laws);
  network.actuators = true;
  for (size_t i = 0; i < all.size(); ++i) {
    const std::string who = "actuator '" + all[i].name + "'";
    const double link = q[size_t(joint_place(*plant.model, all[i].where, who, all[i].joint).q)];
    network.rest.emplace_back(
        all[i].name, vsa::actuator_start(who, all[i].actuator, link, theta[i], all[i].sigma));
  }
  return network;
}

void hold_not_checked(energy_shaping::Certificate& certificate, const Controller& c,
                      const std::string& why) {
  if (c.rate > 0) certificate.report("sampled", c.rate, "rate in Hz, not checked: " + why);
}

}  // namespace porthos::scene
