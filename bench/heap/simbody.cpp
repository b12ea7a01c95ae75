// Simbody (Sherman, Seth, Delp 2011): compliant contacts, semi-explicit Euler.
#include "bench/simbody.h"
#include "bench/heap/heap.h"

int main(int, char** argv) {
  using namespace SimTK;
  const heap::Heap heap(argv);
  const double h = heap.step;
  MultibodySystem system;
  SimbodyMatterSubsystem matter(system);
  GeneralForceSubsystem forces(system);
  ContactTrackerSubsystem tracker(system);
  CompliantContactSubsystem contact(system, tracker);
  contact.setTransitionVelocity(1e-2);
  Force::UniformGravity gravity(forces, matter, Vec3(0, 0, -heap.g));
  const double E = 2e6;  // [Pa]
  const ContactMaterial stuff(E, heap.elastic ? 0 : 5, heap.friction, heap.friction, 0);
  const double L = heap.width;
  const Vec3 normal[] = {{0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}},
             at[] = {{0, 0, 0}, {0, 0, 0}, {L, 0, 0}, {0, 0, 0}, {0, L, 0}};
  for (int i = 0; i < 5; ++i)
    matter.Ground().updBody().addContactSurface(
        Transform(Rotation(UnitVec3(-normal[i]), XAxis), at[i]),
        ContactSurface(ContactGeometry::HalfSpace(), stuff));
  Body::Rigid body(MassProperties(1, Vec3(0), Inertia(heap.inertia)));
  body.addContactSurface(Transform(), ContactSurface(ContactGeometry::Sphere(heap.radius), stuff));
  std::vector<MobilizedBody::Free> balls;
  for (size_t i = 0; i < heap.n; ++i) balls.emplace_back(matter.Ground(), body);
  State start = system.realizeTopology();
  for (size_t i = 0; i < heap.n; ++i)
    balls[i].setQToFitTranslation(start,
                                  Vec3(heap.start[i][0], heap.start[i][1], heap.start[i][2]));
  SemiExplicitEulerIntegrator method(system, h);
  method.setAllowInterpolation(false);
  TimeStepper stepper(system, method);
  stepper.initialize(start);
  double t = 0;
  heap::run(
      "simbody", heap,
      [&] {
        t += h;
        stepper.stepTo(t);
      },
      [&](std::vector<heap::Place>& p, double& H) {
        const State& s = stepper.getState();
        system.realize(s, Stage::Velocity);
        H = matter.calcKineticEnergy(s);
        for (size_t i = 0; i < heap.n; ++i) {
          const Vec3 x = balls[i].getBodyOriginLocation(s);
          p[i] = {x[0], x[1], x[2]};
          H += heap.g * x[2];
        }
      });
}
