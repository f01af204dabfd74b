#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/core/own_directory.h"
#include "sim/scene/sweep_reader.h"
#include "sim/store/sweep_files.h"

namespace touchfield {

/// What a sweep set out to do, as sweep.json in its directory keeps it; without `base`, the path of the scene file.
struct SweepIdentity : SweepPlan {
  std::string hash;  // plan_hash
};

/// What the cases of a directory came to.
struct CaseRecords {
  std::map<int, SweepRecord> whole;
  std::map<int, std::string> damaged;  // what is wrong with those that are no longer what they were when they finished
};

/// The directory of a sweep:
///
///   sweep.json            the plan; there before the first case
///   cases/00001/          a case: its run and case.json, there whole or not at all; an empty folder is no case
///   cases/.00002.PID/     one that is being computed
///   sweep.lock            locked with the directory by processes that compute: for other machines
///   sweep.csv             the table
///
/// Everything lands by a rename after it has been flushed to the disk. Nothing outside of the directory is written to
/// or removed, whatever links it holds.
class SweepDirectory {
 public:
  /// Makes the directory, or opens it to continue, and locks it.
  ///
  /// shared   with other processes that compute other cases of the sweep and share it too; else what killed ones left
  ///          is removed
  /// throws   InputError if it holds another plan than this one (naming the first difference), or a file of another
  ///          version; if another process works in it, or if it cannot be made or written to
  static SweepDirectory open(const std::string& path, const SweepIdentity& identity, bool shared = false);

  const std::string& path() const { return own_.path(); }
  std::string file(const std::string& name) const { return path() + "/" + name; }

  CaseRecords records() const;

  /// A new empty folder for a case to be computed in.
  /// throws   IoError
  std::string scratch(int number) const;

  /// Puts a case in its place. Its files are added to the record, and the record is written into its scratch folder.
  /// This folder then gets the case's name. An older folder of that name is removed. Files in it that no case wrote
  /// move to the new folder, unless that has a file of the same name.
  /// throws   IoError; the scratch folder is then still there
  void land(SweepRecord& record, const std::string& scratch) const;

  /// Removes a scratch folder and what is in it.
  static void drop(const std::string& scratch) noexcept;

 private:
  SweepDirectory(const std::string& path, bool shared);
  void clear_leftovers() const;

  OwnDirectory own_;
};

/// The directory of a sweep, of which nobody else writes files meanwhile. What killed processes left of its own files
/// half-written is removed.
/// lock_file, shared, throws   as of OwnDirectory
OwnDirectory own_sweep_directory(const std::string& path, const std::string& lock_file = {}, bool shared = false);

/// The plan of a directory.
/// throws   InputError if it holds none, IoError if it cannot be read
SweepIdentity read_identity(const std::string& directory);

/// The cases in a directory, by number, without locking it. A case is whole if its record can be read and every file of
/// the record is there. Each file must also have the length and the CRC-32 in the record.
CaseRecords read_records(const std::string& directory);

/// The table of a plan, or of part of its cases, from what there is of them.
SweepSummary summary_of(const SweepPlan& plan, int cases, const std::map<int, SweepRecord>& records);

/// What lies in a directory.
struct SweepCollection {
  SweepSummary summary;
  std::vector<std::string> gaps;  // a line each: damaged cases, and those that are missing
};

/// throws   InputError if there is no sweep
SweepCollection collect_sweep(const std::string& directory);

}  // namespace touchfield
