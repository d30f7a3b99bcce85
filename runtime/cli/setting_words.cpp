// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/setting_words.h"

#include <CLI/CLI.hpp>

namespace gsc {

namespace {

const char* wordsOf(Setting setting)
{
    switch (setting) {
    case Setting::DeviceMemory:
        return "--vram-budget";
    case Setting::CacheMemory:
        return "--cache-budget";
    case Setting::ImageSize:
        return "--size";
    case Setting::FieldOfView:
        return "--fov";
    case Setting::Detail:
        return "--detail";
    case Setting::Appearance:
        return "--appearance";
    case Setting::CpuBackend:
        return "--backend cpu";
    case Setting::InjectedFault:
        return "--inject";
    case Setting::DeviceList:
        return "gsc-play backends";
    case Setting::LensDistortion:
        return "--ignore-distortion";
    case Setting::CameraTransform:
        return "--cameras-transform";
    case Setting::Overwrite:
        return "-w";
    case Setting::ReportFormat:
        return "--format";
    case Setting::Validation:
        return "gsc validate";
    case Setting::Conversion:
        return "gsc convert";
    case Setting::Unpacking:
        return "gsc archive --extract";
    }
    return "";
}

} // namespace

Error withOptions(const Error& error, const CLI::App* command)
{
    std::vector<std::string> all;
    for (const Setting setting : error.settings()) {
        const std::string words = wordsOf(setting);
        const bool is_option = words.starts_with('-');
        if (!is_option || command == nullptr ||
            command->get_option_no_throw(words.substr(0, words.find(' '))) != nullptr)
            all.push_back(words);
    }
    std::string text;
    for (size_t i = 0; i < all.size(); ++i)
        text += (i == 0 ? "" : i + 1 < all.size() ? ", " : " or ") + all[i];
    return text.empty() ? error
                        : Error(error.code(), error.subject(), error.found(), error.expected(),
                                error.remedy() + " (" + text + ")");
}

std::string warningText(const Error& error)
{
    return withOptions(error, nullptr).what();
}

} // namespace gsc
