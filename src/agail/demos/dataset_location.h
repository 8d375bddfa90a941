// Where demonstrations lie: one HDF5 file, or a Minari dataset folder, given by its path or by its
// id.
#pragma once

#include <string>

namespace agail {

struct DatasetLocation {
  std::string data;  // the HDF5 file
  std::string
      metadata;  // metadata.json; empty: the metadata are attributes of the HDF5 file's root
};

// Throws InputError if nothing readable is there.
DatasetLocation locate_dataset(const std::string& path_or_id);

// Where Minari keeps its datasets: MINARI_DATASETS_PATH, or without it ~/.minari/datasets.
std::string minari_root();

// The id that Minari will know a dataset folder by. In Minari's own folder this is the path below
// it, which must then have Minari's form (namespace/name-v0; else InputError, as Minari could list
// no dataset any more); elsewhere the folder's name, made to fit.
std::string dataset_id_for(const std::string& folder);

// `x.hdf5`: one file; any other name: a folder.
bool is_single_file(const std::string& path);

}  // namespace agail
