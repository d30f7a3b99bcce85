// SPDX-License-Identifier: Apache-2.0
// A small tree of commands to parse.
#pragma once

#include "runtime/cli/options.h"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

struct Tree {
    CLI::App app{"", "prog"};
    CLI::App *make = nullptr, *sample = nullptr, *city = nullptr;
    std::string input, output, report;
    std::vector<std::string> many;
    bool quiet = false, whole = false;
    int verbose = 0, seed = 0, mode = 0;

    Tree()
    {
        app.set_version_flag("--version", "prog 1");
        app.require_subcommand(0, 1);
        make = app.add_subcommand("make", "Make it");
        gsc::addText(*make, "INPUT,-i,--input", input, "MODEL|FILE.ply", "what from").required();
        gsc::addText(*make, "-o,--output", output, "FILE.gsc", "what to").required();
        const gsc::OptionHandle report_option = gsc::addText(*make, "--report", report, "FILE.json", "report");
        gsc::addChoice<int>(*make, "--mode", mode, {{"fast", 1}, {"exact", 2}}, "default: fast", "how");
        gsc::addInteger(*make, "--memory-budget", seed, 0, 9, "N", "how much").needs(report_option);
        gsc::addFlag(*make, "--whole", whole, "all of it").excludes(report_option);
        gsc::addFlag(*make, "-q,--quiet", quiet, "no words");
        make->add_flag("-v,--verbose", verbose, "more words");
        sample = app.add_subcommand("sample", "Sample it");
        sample->require_subcommand(0, 1);
        city = sample->add_subcommand("city", "A city");
        gsc::addTexts(*city, "--only", many, "walk|orbit", "some");
        gsc::addText(*city, "FILE", input, "FILE.gsc", "file").required();
    }
};
