#include "lib/farm/openjd.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace mocap::farm {
namespace openjd_test {

using ::testing::HasSubstr;

// Whether templates follow the specification is tested in tests/system/retrack_farm_test.py.
FarmOrder order_of(std::size_t units) {
  FarmOrder order;
  order.common = {"/usr/bin/mocapctl", {"--resume"}};
  order.folder = "/new/farm";
  for (std::size_t i = 0; i < units; ++i) {
    order.units.push_back({"/takes/" + std::to_string(i) + ".mcap", "/new/" + std::to_string(i) + ".mcap"});
  }
  return order;
}

TEST(OpenjdTemplate, HasATaskForEachUnit) {
  const auto job = openjd_template(order_of(2));

  ASSERT_TRUE(job) << job.error().message;
  ASSERT_EQ(job->at("steps").size(), 1U);
  const auto& step = job->at("steps")[0];
  const auto& parameters = step.at("parameterSpace").at("taskParameterDefinitions");
  ASSERT_EQ(parameters.size(), 2U);
  EXPECT_EQ(parameters[0].at("range"), nlohmann::ordered_json({"/takes/0.mcap", "/takes/1.mcap"}));
  EXPECT_EQ(parameters[1].at("range"), nlohmann::ordered_json({"/new/0.mcap", "/new/1.mcap"}));
  const auto& action = step.at("script").at("actions").at("onRun");
  EXPECT_EQ(action.at("command"), "/usr/bin/mocapctl");
  EXPECT_EQ(action.at("args")[2], "{{Task.Param.Take}}");
  EXPECT_TRUE(action.at("cancelation").is_object());
}

TEST(OpenjdTemplate, JoinsTheChunksOnceAllAreTracked) {
  FarmOrder order = order_of(600);
  order.units = in_chunks(order.units, 2);

  const auto job = openjd_template(order);

  ASSERT_TRUE(job) << job.error().message;
  const auto& steps = job->at("steps");
  ASSERT_EQ(steps.size(), 3U);
  const auto& parameters = steps[0].at("parameterSpace");
  EXPECT_EQ(parameters.at("taskParameterDefinitions")[2].at("range")[1], "2/2");
  EXPECT_EQ(parameters.at("combination"), "(Take, NewTake, Chunk)");
  const auto& join = steps[2];
  EXPECT_EQ(join.at("dependencies"),
            nlohmann::ordered_json({{{"dependsOn", steps[0].at("name")}}, {{"dependsOn", steps[1].at("name")}}}));
  EXPECT_EQ(join.at("parameterSpace").at("taskParameterDefinitions")[0].at("range").size(), 600U);
  EXPECT_EQ(join.at("script").at("actions").at("onRun").at("args")[2], "{{Task.Param.NewTake}}");
}

TEST(OpenjdTemplate, HasAtMost1024TasksInAStep) {
  const auto job = openjd_template(order_of(1025));

  ASSERT_TRUE(job) << job.error().message;
  const auto& steps = job->at("steps");
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_NE(steps[0].at("name"), steps[1].at("name"));
  EXPECT_EQ(steps[1].at("parameterSpace").at("taskParameterDefinitions")[0].at("range").size(), 1U);
}

TEST(OpenjdTemplate, RefusesWhatATemplateCannotName) {
  for (const std::string& path : {std::string("/a{{b.mcap"), std::string("/a\nb.mcap"), std::string(1100, 'x')}) {
    FarmOrder order = order_of(1);
    order.units[0].take = path;

    const auto refused = openjd_template(order);

    ASSERT_FALSE(refused) << path;
    EXPECT_THAT(refused.error().message, HasSubstr("cannot be in a job template"));
  }
  FarmOrder order = order_of(1);
  order.common.options.push_back("{{");
  EXPECT_FALSE(openjd_template(order));
}

TEST(WriteOpenjd, WritesAJobBundle) {
  const support::TemporaryFolder folder;
  FarmOrder order = order_of(1);
  order.folder = folder.path() / "new" / "farm";

  const auto path = write_openjd(order);

  ASSERT_TRUE(path) << path.error().message;
  EXPECT_EQ(*path, folder.path() / "new/farm/template.json");
  EXPECT_TRUE(std::filesystem::exists(*path));
}

}  // namespace openjd_test
}  // namespace mocap::farm
