// Locks across processes, and across machines that share a file system with locks.
#pragma once

#include <filesystem>

namespace agail {

// The lock belongs to the open file: it ends with the last process that has it open, so that a
// killed owner leaves no stale lock, and a child that was given the descriptor and outlives its
// parent still holds it.
class FileLock {
 public:
  // Not held if another process has it. SystemError if the file system has no locks.
  explicit FileLock(const std::filesystem::path& file);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;
  bool held() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

// Of a folder that exists; a folder can be locked without a file in it. Ends with its owner's
// object, whatever children that were forked meanwhile still have open.
class FolderLock {
 public:
  // Not held if somebody else has it. A file system that cannot lock folders (some network file
  // systems) gives it to everybody. InputError if the folder cannot be opened.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  bool held() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

}  // namespace agail
