// Porthos: the method "moreau".
#include "bench/heap/heap.h"
#include "contact/time_stepping.h"
#include "mechanics/builder.h"
using namespace porthos;
using namespace porthos::contact;
int main(int, char** argv) {
  const heap::Heap heap(argv);
  const double h = heap.step;
  mechanics::MechanismBuilder b("heap");
  std::vector<Surface> balls, both;
  std::vector<double> q, v(6 * heap.n, 0.0);
  Law law;
  law.form = Law::Form::rigid;
  law.restitution = heap.restitution;
  law.friction = heap.friction;
  for (size_t i = 0; i < heap.n; ++i) {
    mechanics::BodySpec s;
    s.name = "b" + std::to_string(i);
    s.parent = "world";
    s.joint.type = "free";
    s.mass.mass = 1;
    const double I = heap.inertia;
    s.mass.inertia = {I, 0, 0, I, 0, I};
    b.add(s);
    Shape ball;
    ball.radius = heap.radius;
    balls.push_back({s.name, ball});
    q.insert(q.end(), heap.start[i].begin(), heap.start[i].end());
    for (int k = 0; k < 4; ++k) q.push_back(k == 0);
  }
  b.gravity({0, 0, -heap.g});
  both = balls;
  for (int k = 0; k < 5; ++k) {
    Shape w;
    w.kind = Kind::plane;
    const double a = k * M_PI / 2, c = std::round(std::cos(a)), s = std::round(std::sin(a)),
                 L = heap.width;
    if (k < 4) {
      w.pose.R = {Vec3d{-s, c, 0}, Vec3d{0, 0, 1}, Vec3d{c, s, 0}};
      w.pose.r = {L / 2 - L / 2 * c, L / 2 - L / 2 * s, 0};
    }
    both.push_back({"world", w});
  }
  auto bodies = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
  auto model =
      std::make_shared<ContactModel>(bodies, bodies, std::vector<Contact>{{"c", balls, both, law}});
  auto method = with_time_stepping(*model, *model, h);
  phs::State state(model->description(), bodies->state(q, v));
  auto system = model->make_system<double>();
  heap::run(
      "porthos", heap,
      [&] {
        if (method->step(state) != integrators::Outcome::ok)
          std::printf("a step failed: %s\n", method->remark().c_str());
      },
      [&](std::vector<heap::Place>& p, double& H) {
        for (size_t i = 0; i < heap.n; ++i)
          for (size_t a = 0; a < 3; ++a) p[i][a] = state.x[7 * i + a];
        H = system->hamiltonian(state.x);
      });
  std::printf("  %s\n", method->remark().c_str());
}
