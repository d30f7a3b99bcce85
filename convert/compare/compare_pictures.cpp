// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/compare_pictures.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <filesystem>
#include <map>

namespace gsc {

namespace fs = std::filesystem;

namespace {

using Pictures = std::map<std::string, std::string>; // paths by file name without extension

// Adds the pictures of a folder that are of lossy kinds, or all others, but those whose name is there already.
void addPictures(const std::string& folder, bool lossy, Pictures& pictures)
{
    Pictures added;
    std::error_code error;
    fs::directory_iterator entry(folder, error);
    for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
        const fs::path& path = entry->path();
        if (!entry->is_regular_file(error) || !isImageExtension(path.string()) ||
            isLossyExtension(path.string()) != lossy || pictures.contains(path.stem().string()))
            continue;
        const auto [other, is_new] = added.emplace(path.stem().string(), path.string());
        if (!is_new)
            throw Error(ErrorCode::InvalidFile, path.string(), "the same name as " + other->second,
                        "one picture of a name", "move one away");
    }
    if (error)
        throw Error(ErrorCode::Io, folder, "cannot be read (" + error.message() + ")", "a folder of pictures",
                    "check the path");
    pictures.merge(added);
}

// A JPEG beside a lossless picture of its name is left out: many keep one for their web page.
Pictures picturesOf(const std::string& folder)
{
    Pictures pictures;
    for (const bool lossy : {false, true})
        addPictures(folder, lossy, pictures);
    if (pictures.empty())
        throw Error(ErrorCode::InvalidFile, folder, "holds no picture", "files with the extension " + imageExtensions(),
                    "pass another folder");
    return pictures;
}

ScoredPicture compareFiles(const std::string& name, const std::string& reference, const std::string& picture,
                           const Lpips* lpips)
{
    const Image expected = readImage(reference), actual = readImage(picture);
    if (actual.width != expected.width || actual.height != expected.height)
        throw Error(ErrorCode::InvalidFile, picture, formatString("%ux%u pixels", actual.width, actual.height),
                    formatString("the %ux%u of %s", expected.width, expected.height, reference.c_str()),
                    "draw both with one --size");
    return scorePicture(name, expected, actual, lpips);
}

} // namespace

PictureSet comparePictures(const std::string& reference, const std::string& pictures, const Lpips* lpips,
                           Reporter& report)
{
    PictureSet set;
    if (!fs::is_directory(reference)) {
        set.add(compareFiles(fs::path(reference).stem().string(), reference, pictures, lpips));
        return set;
    }
    const Pictures wanted = picturesOf(reference), found = picturesOf(pictures);
    for (const auto& [name, path] : wanted) // warns of pictures without a partner before any picture is read
        if (!found.contains(name))
            throw Error(ErrorCode::Io, pictures, "no picture of the name " + name, "one for " + path, "draw it too");
    for (const auto& [name, path] : wanted) {
        throwIfInterrupted();
        report.progress("pictures", set.views.size(), wanted.size());
        set.add(compareFiles(name, path, found.at(name), lpips));
    }
    report.endProgress(false);
    if (found.size() > wanted.size())
        report.warning(formatString("not compared: %zu of the pictures in %s, whose names %s does not have",
                                    found.size() - wanted.size(), pictures.c_str(), reference.c_str()));
    return set;
}

} // namespace gsc
