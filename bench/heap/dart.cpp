// DART (Lee et al. 2018): impulses by its projected Gauss-Seidel, which first builds the matrix of
// all contacts; spheres and boxes by FCL.
#include "bench/heap/heap.h"

#include <algorithm>
#include <dart/collision/fcl/FCLCollisionDetector.hpp>
#include <dart/config.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
int main(int, char** argv) {
  using namespace dart;
  using namespace dart::dynamics;
  const heap::Heap heap(argv);
  const double h = heap.step;
  auto world = simulation::World::create();
  world->setTimeStep(h);
  world->setGravity({0, 0, -heap.g});
  auto detector = collision::FCLCollisionDetector::create();
  detector->setPrimitiveShapeType(collision::FCLCollisionDetector::PRIMITIVE);
  detector->setContactPointComputationMethod(collision::FCLCollisionDetector::DART);
  auto solver = std::make_unique<constraint::BoxedLcpConstraintSolver>(
      std::make_shared<constraint::PgsBoxedLcpSolver>());
  solver->setCollisionDetector(detector);
  solver->getCollisionOption().maxNumContacts = 20 * heap.n;
  world->setConstraintSolver(std::move(solver));
  const double L = heap.width, T = 20;
  const Eigen::Vector3d places[] = {
      {0, 0, -T / 2}, {-T / 2, 0, 0}, {L + T / 2, 0, 0}, {0, -T / 2, 0}, {0, L + T / 2, 0}};
  for (const auto& at : places) {
    auto s = Skeleton::create();
    auto [j, b] = s->createJointAndBodyNodePair<WeldJoint>();
    (void)j;
    const Eigen::Vector3d size(at.x() != 0 ? T : 2 * T, at.y() != 0 ? T : 2 * T,
                               at.z() != 0 ? T : 2 * T);
    auto* shape =
        b->createShapeNodeWith<CollisionAspect, DynamicsAspect>(std::make_shared<BoxShape>(size));
    shape->getDynamicsAspect()->setFrictionCoeff(heap.friction);
    shape->getDynamicsAspect()->setRestitutionCoeff(heap.restitution);
    shape->setRelativeTranslation(at);
    world->addSkeleton(s);
  }
  std::vector<SkeletonPtr> balls;
  auto sphere = std::make_shared<SphereShape>(heap.radius);
  for (size_t i = 0; i < heap.n; ++i) {
    auto s = Skeleton::create("b" + std::to_string(i));
    auto [j, b] = s->createJointAndBodyNodePair<FreeJoint>();
    (void)j;
    auto* shape = b->createShapeNodeWith<CollisionAspect, DynamicsAspect>(sphere);
    shape->getDynamicsAspect()->setFrictionCoeff(heap.friction);
    shape->getDynamicsAspect()->setRestitutionCoeff(heap.restitution);
    Inertia inertia(1, Eigen::Vector3d::Zero(), heap.inertia * Eigen::Matrix3d::Identity());
    b->setInertia(inertia);
    Eigen::VectorXd q = Eigen::VectorXd::Zero(6);
    for (int a = 0; a < 3; ++a) q[3 + a] = heap.start[i][size_t(a)];
    s->setPositions(q);
    balls.push_back(s);
    world->addSkeleton(s);
  }
  heap::run(
      "dart", heap, [&] { world->step(); },
      [&](std::vector<heap::Place>& p, double& H) {
        H = 0;
        for (size_t i = 0; i < heap.n; ++i) {
          const Eigen::VectorXd q = balls[i]->getPositions();
          p[i] = {q[3], q[4], q[5]};
          H += balls[i]->computeKineticEnergy() + heap.g * q[5];
        }
      });
}
