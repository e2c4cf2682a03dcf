// bake_observer.h: learns how a bake goes on, to tell people or an application.
#pragma once

#include <string>

namespace clamor {

struct BakeProgress;
struct ImportReport;
struct LevelReport;
struct ProbePlacement;

// Functions may be called from several threads, one call at a time.
class BakeObserver {
 public:
  virtual ~BakeObserver() = default;
  // A stage begins, which ends with the next one or with on_progress().
  virtual void on_stage(const std::string& /*stage*/) {}
  // `level` is the level's name.
  virtual void on_import(const std::string& /*level*/, const ImportReport&) {}
  virtual void on_prepared(const LevelReport&) {}
  virtual void on_probes(const ProbePlacement&) {}
  virtual void on_warning(const std::string&) {}
  virtual void on_progress(const BakeProgress&) {}
  virtual void on_writing() {}
};

}  // namespace clamor
