// Slate's declarative syntax: SNew(Type).Argument(value)[child].
#pragma once

#include "Widgets/SWidget.h"

// The arguments that every widget takes.
template <class Arguments>
struct TSlateBaseNamedArgs {
  Arguments& ToolTipText(const FText& text) {
    _ToolTipText = text;
    return static_cast<Arguments&>(*this);
  }
  Arguments& operator[](const TSharedRef<SWidget>& child) {
    _Children.push_back(child.held);
    return static_cast<Arguments&>(*this);
  }
  FText _ToolTipText;
  std::vector<std::shared_ptr<SWidget>> _Children;
};

#define SLATE_BEGIN_ARGS(WidgetType)                           \
 public:                                                       \
  struct FArguments : public TSlateBaseNamedArgs<FArguments> { \
    typedef FArguments WidgetArgsType;                         \
    FArguments()
#define SLATE_ARGUMENT(Type, Name)             \
  Type _##Name{};                              \
  WidgetArgsType& Name(const Type& argument) { \
    _##Name = argument;                        \
    return *this;                              \
  }
#define SLATE_EVENT(Type, Name)                                                                                  \
  Type _##Name;                                                                                                  \
  WidgetArgsType& Name(const Type& event) {                                                                      \
    _##Name = event;                                                                                             \
    return *this;                                                                                                \
  }                                                                                                              \
  template <class User, class Method>                                                                            \
  WidgetArgsType& Name(User* user, Method method) {                                                              \
    _##Name = Type::CreateLambda([user, method](auto&&... arguments) { return (user->*method)(arguments...); }); \
    return *this;                                                                                                \
  }
#define SLATE_END_ARGS() \
  }                      \
  ;

namespace StandIn {
template <class Widget>
struct Declare {
  TSharedRef<Widget> operator<<=(const typename Widget::FArguments& arguments) const {
    const TSharedRef<Widget> made(std::make_shared<Widget>());
    made->ToolTip = arguments._ToolTipText;
    made->Children = arguments._Children;
    made->Construct(arguments);
    return made;
  }
};
template <class Widget>
struct Assign {
  TSharedPtr<Widget>& into;
  TSharedRef<Widget> operator<<=(const typename Widget::FArguments& arguments) const {
    const TSharedRef<Widget> made = Declare<Widget>() <<= arguments;
    into = made;
    return made;
  }
};
}  // namespace StandIn
#define SNew(Type) StandIn::Declare<Type>() <<= Type::FArguments()
#define SAssignNew(Into, Type) StandIn::Assign<Type>{Into} <<= Type::FArguments()
