/* mujoco MODEL q1 q2 v1 v2 step duration every: the double pendulum by MuJoCo's Runge-Kutta 4, as CSV on stdout. */
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char** argv) {
  if (argc != 9) return fprintf(stderr, "expected MODEL and 7 numbers\n"), 2;
  double x[7];
  for (int k = 0; k < 7; ++k) x[k] = atof(argv[k + 2]);
  char why[500] = "";
  mjModel* m = mj_loadXML(argv[1], NULL, why, sizeof why);
  if (!m || m->nq != 2) return fprintf(stderr, "%s\n", why), 1;
  m->opt.timestep = x[4];
  m->opt.integrator = mjINT_RK4;
  m->opt.disableflags |= mjDSBL_CONTACT;
  mjData* d = mj_makeData(m);
  for (int k = 0; k < 2; ++k) d->qpos[k] = x[k], d->qvel[k] = x[2 + k];
  const long steps = lround(x[5] / x[4]), every = lround(x[6] / x[4]);
  printf("t,q1,q2,v1,v2\n");
  for (long i = 0; i <= steps; ++i) {
    if (i % every == 0)
      printf("%.17g,%.17g,%.17g,%.17g,%.17g\n", i * x[4], d->qpos[0], d->qpos[1], d->qvel[0], d->qvel[1]);
    mj_step(m, d);
  }
  mj_deleteData(d), mj_deleteModel(m);
  return 0;
}
