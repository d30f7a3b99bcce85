// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint_files.h"

#include "convert/input/input_file.h"
#include <gsc/error.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <system_error>

namespace gsc {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> listNames(const fs::path& folder)
{
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
        names.push_back(it->path().filename().string());
    if (error)
        throw Error(ErrorCode::Io, folder.string(), "cannot be listed (" + error.message() + ")", "a readable folder",
                    "check the path and its permissions");
    std::sort(names.begin(), names.end());
    return names;
}

// Returns the number n of a folder name "iteration_<n>", or nothing for any other name.
std::optional<int> iterationOf(const std::string& name)
{
    constexpr std::string_view prefix = "iteration_";
    if (!name.starts_with(prefix))
        return std::nullopt;
    int number = 0;
    const char* end = name.data() + name.size();
    const auto parsed = std::from_chars(name.data() + prefix.size(), end, number);
    if (parsed.ec != std::errc() || parsed.ptr != end || number < 0)
        return std::nullopt;
    return number;
}

std::string join(const std::vector<std::string>& names, size_t most = 8)
{
    std::string text;
    for (size_t i = 0; i < names.size() && i < most; ++i)
        text += (i ? ", " : "") + names[i];
    if (names.size() > most)
        text += formatString(" and %zu more", names.size() - most);
    return text.empty() ? "nothing" : text;
}

// Throws if a file name in `names` shows that a method we cannot read wrote the folder.
void refuseOtherMethods(const fs::path& folder, const std::vector<std::string>& names)
{
    for (const std::string& name : names) {
        const auto refuse = [&](const char* is, const char* expected, const char* remedy) {
            throw Error(ErrorCode::Unsupported, (folder / name).string(), is, expected, remedy);
        };
        const std::string_view view = name;
        if (view == "sogs_config.json" || view.starts_with("second_order_mlp"))
            refuse("belongs to a SOGS model, whose MLPs take second-order features", "a Scaffold-GS or Octree-GS model",
                   "train without second-order anchors");
        if (view == "point_cloud_quantized.npz")
            refuse("is a quantised model that its trainer reads instead of the PLY", "an unquantised one",
                   "move the npz away to convert the PLY beside it");
        if (view.starts_with("point_cloud_rk") || (view.starts_with("_rk") && view.ends_with(".pt")))
            refuse("is one rank's part of a distributed CityGS-X model", "one point_cloud.ply",
                   "merge the ranks and save again on one GPU");
        if (view.ends_with(".ckpt") || view == "nerfstudio_models")
            refuse("is a nerfstudio checkpoint", "a point_cloud.ply with MLP files",
                   "export the model in the layout of Scaffold-GS");
    }
}

void refuseTrainingState(const fs::path& folder, const std::vector<std::string>& names)
{
    for (const std::string& name : names)
        if (name.starts_with("chkpnt") && name.ends_with(".pth"))
            throw Error(ErrorCode::Unsupported, (folder / name).string(),
                        "is the state of a training run and holds no anchor features", "point_cloud/iteration_<n>",
                        "save the model with --save_iterations");
}

bool contains(const std::vector<std::string>& names, std::string_view name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

// Returns the iteration folder to read in point_cloud/, or point_cloud/ itself if the files lie in it directly.
// `wanted`: number of the iteration, -1 = the highest.
fs::path chooseIteration(const fs::path& point_cloud, const std::vector<std::string>& names, int wanted,
                         std::vector<std::string>& warnings)
{
    // by number; of "iteration_007" and "iteration_7" the first one is taken
    std::map<int, std::string> iterations;
    std::vector<std::string> foreign;
    for (const std::string& name : names) {
        if (const auto number = iterationOf(name))
            iterations.emplace(*number, name);
        else
            foreign.push_back(name);
    }
    if (iterations.empty() && wanted < 0)
        return point_cloud;
    const auto chosen = wanted >= 0 ? iterations.find(wanted) : std::prev(iterations.end());
    if (chosen == iterations.end()) {
        std::vector<std::string> found;
        for (const auto& [number, name] : iterations)
            found.push_back(std::to_string(number));
        throw Error(ErrorCode::Usage, point_cloud,
                    formatString("has no iteration_%d, found %s", wanted, join(found).c_str()), "it for --iteration",
                    "pass one that was found, or leave --iteration out");
    }
    if (!foreign.empty() && !contains(names, "point_cloud.ply"))
        warnings.push_back(point_cloud.string() + ": ignored " + join(foreign) + ", which is no iteration_<n>");
    return point_cloud / chosen->second;
}

// Absolute path of a folder, without a slash at its end, so that filename() is not empty.
fs::path named(const fs::path& folder)
{
    const fs::path path = fs::absolute(folder).lexically_normal();
    return path.has_filename() ? path : path.parent_path();
}

// Folders in which the model's settings and cameras may lie: `folder`, those above it that belong to the model
// (iteration_<n> lies in point_cloud, which lies in the model folder), --scene-dir.
std::vector<std::string> sideFolders(const fs::path& folder, const std::string& scene_dir)
{
    std::vector<std::string> folders = {folder.string()};
    fs::path at = named(folder);
    fs::path shown = folder;
    for (int i = 0; i < 2 && (iterationOf(at.filename().string()) || at.filename() == "point_cloud"); ++i) {
        at = at.parent_path();
        shown = shown.has_parent_path() && shown.filename() != "." && shown.filename() != ".." && shown.has_filename()
                    ? shown.parent_path()
                    : at;
        folders.push_back(shown.string());
    }
    if (!scene_dir.empty())
        folders.push_back(scene_dir);
    return folders;
}

// Warns of each file in --scene-dir that is not read because the model has one of the same name.
void warnOfHiddenFiles(const std::string& scene_dir, CheckpointFiles& files)
{
    for (const char* name : {"cfg_args", "config.yaml", "cameras.json", "metre.json", "transforms.json",
                             "transforms_train.json", "transforms_test.json"}) {
        std::error_code none;
        const fs::path there = fs::path(scene_dir) / name;
        if (const std::string taken = files.findBeside(name);
            fs::is_regular_file(there, none) && !fs::equivalent(there, taken, none))
            files.warnings.push_back(there.string() + ": is not read, because " + taken +
                                     " lies beside the model; move " + "one of them away if this is not what you want");
    }
}

void requirePly(CheckpointFiles& files)
{
    const fs::path folder = files.folder;
    refuseOtherMethods(folder, files.file_names);
    if (files.has("point_cloud.ply")) {
        files.ply = (folder / "point_cloud.ply").string();
        return;
    }
    refuseTrainingState(folder, files.file_names);
    throw Error(ErrorCode::InvalidFile, files.folder, "no anchors, found " + join(files.file_names),
                "point_cloud.ply, point_cloud/iteration_<n>/point_cloud.ply or iteration_<n>/point_cloud.ply",
                "pass the folder the trainer wrote, or the PLY itself");
}

void findInFile(const fs::path& path, CheckpointFiles& files)
{
    const std::string name = path.filename().string();
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    refuseOtherMethods(folder, {name});
    refuseTrainingState(folder, {name});
    if (path.extension() != ".ply") {
        std::error_code error;
        if (fs::is_regular_file(path, error))
            // opened only because this throws a better message if the file is a stand-in, such as a Git LFS pointer
            (void)InputFile(path.string());
        throw Error(ErrorCode::InvalidFile, path.string(), "is neither a folder nor a PLY", "a trained model",
                    "pass its folder or its point_cloud.ply");
    }
    files.folder = folder.string();
    files.ply = path.string();
    files.file_names = listNames(folder);
    refuseOtherMethods(folder, files.file_names);
}

void findInFolder(const fs::path& path, int iteration, CheckpointFiles& files)
{
    fs::path folder = path;
    std::vector<std::string> names = listNames(folder);
    if (contains(names, "point_cloud") && fs::is_directory(folder / "point_cloud")) {
        folder /= "point_cloud";
        names = listNames(folder);
    }
    const bool point_cloud =
        std::any_of(names.begin(), names.end(), [](const std::string& name) { return iterationOf(name).has_value(); });
    if (point_cloud || (iteration >= 0 && folder != path)) {
        folder = chooseIteration(folder, names, iteration, files.warnings);
        names = listNames(folder);
    }
    files.folder = folder.string();
    files.file_names = names;
    requirePly(files);
}

} // namespace

bool CheckpointFiles::has(std::string_view file_name) const
{
    return contains(file_names, file_name);
}

std::string CheckpointFiles::findBeside(const std::string& file_name) const
{
    for (const std::string& side : side_dirs) {
        std::error_code error;
        const fs::path candidate = fs::path(side) / file_name;
        if (fs::is_regular_file(candidate, error))
            return candidate.string();
    }
    return {};
}

CheckpointFiles findCheckpointFiles(const std::string& path, const CheckpointOptions& options)
{
    CheckpointFiles files;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (error || !fs::exists(status))
        throw Error(ErrorCode::Io, path, "does not exist", "a trained model", "check the path");
    if (fs::is_directory(status))
        findInFolder(path, options.iteration, files);
    else
        findInFile(path, files);
    files.iteration = iterationOf(named(files.folder).filename().string()).value_or(-1);
    if (options.iteration >= 0 && files.iteration != options.iteration)
        throw Error(ErrorCode::Usage, files.folder, "is another iteration",
                    formatString("iteration %d as --iteration says", options.iteration),
                    "pass the model folder, or leave --iteration out");
    std::error_code ignored_scene;
    if (!options.scene_dir.empty() && !fs::is_directory(options.scene_dir, ignored_scene))
        throw Error(ErrorCode::Io, options.scene_dir, "is no folder", "the scene's", "check the path of --scene-dir");
    files.side_dirs = sideFolders(files.folder, options.scene_dir);
    if (!options.scene_dir.empty())
        warnOfHiddenFiles(options.scene_dir, files);
    return files;
}

} // namespace gsc
