// Bullet (Coumans): impulses by sweeps, 10 a step, overlaps pushed back (its defaults), no sleep.
#include "bench/heap/heap.h"

#include <btBulletDynamicsCommon.h>
int main(int, char** argv) {
  const heap::Heap heap(argv);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broad;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broad, &solver, &configuration);
  world.setGravity({0, 0, -heap.g});
  const double mu = std::sqrt(heap.friction);
  const double L = heap.width;
  const btVector3 normals[] = {{0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  const double offsets[] = {0, 0, -L, 0, -L};
  for (int k = 0; k < 5; ++k) {
    auto* shape = new btStaticPlaneShape(normals[k], offsets[k]);
    btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape);
    info.m_friction = mu;
    info.m_restitution = heap.restitution;
    world.addRigidBody(new btRigidBody(info));
  }
  auto* ball = new btSphereShape(heap.radius);
  std::vector<btRigidBody*> bodies;
  const double I = heap.inertia;
  for (const auto& p : heap.start) {
    btTransform at;
    at.setIdentity();
    at.setOrigin({p[0], p[1], p[2]});
    btRigidBody::btRigidBodyConstructionInfo info(1, new btDefaultMotionState(at), ball, {I, I, I});
    info.m_friction = mu;
    info.m_restitution = heap.restitution;
    info.m_linearDamping = info.m_angularDamping = 0;
    auto* b = new btRigidBody(info);
    b->setActivationState(DISABLE_DEACTIVATION);
    bodies.push_back(b);
    world.addRigidBody(b);
  }
  heap::run(
      "bullet", heap, [&] { world.stepSimulation(heap.step, 0); },
      [&](std::vector<heap::Place>& p, double& H) {
        H = 0;
        for (size_t i = 0; i < heap.n; ++i) {
          const auto& x = bodies[i]->getWorldTransform().getOrigin();
          p[i] = {x.x(), x.y(), x.z()};
          H += 0.5 * bodies[i]->getLinearVelocity().length2() +
               0.5 * I * bodies[i]->getAngularVelocity().length2() + heap.g * x.z();
        }
      });
}
