#include "scene/read/controllers/held_law.h"

#include <fmt/format.h>

#include "energy_shaping/held_loop.h"
#include "scene/read/scene.h"

namespace porthos::scene {

std::string certify_held(energy_shaping::Certificate& certificate, const Controller& c,
                         const ControllerPlant& plant,
                         const std::vector<energy_shaping::PortLaw>& laws,
                         std::span<const double> q) {
  if (c.rate == 0) return "";
  std::vector<double> x(q.begin(), q.end());
  x.resize(size_t(plant.model->description().nx), 0.0);
  energy_shaping::Certificate own;
  certify_sampled(own, held_loop(*plant.model, laws, x), 1 / c.rate, c.sensing.delay);
  const energy_shaping::CertificateItem& item = own.items().front();
  const bool alone = plant.scene.elements.empty() && plant.scene.actuators.empty();
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

}  // namespace porthos::scene
