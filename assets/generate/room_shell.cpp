#include "room_shell.h"

namespace clamor::assets {

namespace {

// One wall in its own coordinates: u and v along it, u x v into the room.
struct Wall {
  Side side;
  const std::vector<double>&u_m, &v_m;
  int u_axis, v_axis, w_axis;
  double plane_m, outward;  // where it is along w, and which way is out

  Vec3 at(double u, double v, double recess_m) const {
    Vec3 p(0);
    p[u_axis] = u;
    p[v_axis] = v;
    p[w_axis] = plane_m + outward * recess_m;
    return p;
  }
};

Cell cell_at(const Wall& wall, const WallPlan& plan, std::size_t i, std::size_t j) {
  const double u = (wall.u_m[i] + wall.u_m[i + 1]) / 2, v = (wall.v_m[j] + wall.v_m[j + 1]) / 2;
  return plan(wall.side, wall.at(u, v, 0));
}

// The rim of a recessed cell towards a neighbour that lies nearer to the room.
void add_rims(MeshBuilder& mesh, const Wall& wall, const WallPlan& plan, MaterialIndex reveal,
              std::size_t i, std::size_t j) {
  const double depth = cell_at(wall, plan, i, j).recess_m;
  const std::size_t columns = wall.u_m.size() - 1, rows = wall.v_m.size() - 1;
  const double u0 = wall.u_m[i], u1 = wall.u_m[i + 1], v0 = wall.v_m[j], v1 = wall.v_m[j + 1];
  // From a to b the recess lies to the left, seen from inside the room.
  const auto rim = [&](bool inside, std::size_t ni, std::size_t nj, double ua, double va, double ub,
                       double vb) {
    const double near = inside ? cell_at(wall, plan, ni, nj).recess_m : 0;
    if (near >= depth) return;
    mesh.quad(reveal, wall.at(ua, va, near), wall.at(ub, vb, near), wall.at(ub, vb, depth),
              wall.at(ua, va, depth));
  };
  rim(j > 0, i, j - 1, u0, v0, u1, v0);
  rim(i + 1 < columns, i + 1, j, u1, v0, u1, v1);
  rim(j + 1 < rows, i, j + 1, u1, v1, u0, v1);
  rim(i > 0, i - 1, j, u0, v1, u0, v0);
}

}  // namespace

MeshBuilder make_shell(const ShellGrid& grid, MaterialIndex reveal, const WallPlan& plan) {
  const auto &x = grid.x_m, &y = grid.y_m, &z = grid.z_m;
  const Wall walls[] = {
      {Side::kFloor, z, x, 2, 0, 1, y.front(), -1}, {Side::kCeiling, x, z, 0, 2, 1, y.back(), 1},
      {Side::kLeft, y, z, 1, 2, 0, x.front(), -1},  {Side::kRight, z, y, 2, 1, 0, x.back(), 1},
      {Side::kFront, x, y, 0, 1, 2, z.front(), -1}, {Side::kBack, y, x, 1, 0, 2, z.back(), 1}};
  MeshBuilder mesh;
  for (const Wall& wall : walls) {
    for (std::size_t i = 0; i + 1 < wall.u_m.size(); ++i) {
      for (std::size_t j = 0; j + 1 < wall.v_m.size(); ++j) {
        const Cell cell = cell_at(wall, plan, i, j);
        const double u0 = wall.u_m[i], u1 = wall.u_m[i + 1];
        const double v0 = wall.v_m[j], v1 = wall.v_m[j + 1], depth = cell.recess_m;
        mesh.quad(cell.material, wall.at(u0, v0, depth), wall.at(u1, v0, depth),
                  wall.at(u1, v1, depth), wall.at(u0, v1, depth));
        add_rims(mesh, wall, plan, reveal, i, j);
      }
    }
  }
  return mesh;
}

}  // namespace clamor::assets
